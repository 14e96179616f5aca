"""Clearances on arcs in scenes small enough to work out by hand."""

from __future__ import annotations

import math

import pytest
import torch

from agents.features.arcs import ARCS, HORIZONS, TIME_STEP, TOP_SPEED, TOP_TURN_RATE, arc_clearances

GOAL = torch.zeros(1, 2)
STRAIGHT, BACK, LEFT = ARCS.index((1.0, 0.0)), ARCS.index((-1.0, 0.0)), ARCS.index((1.0, 1.0))
LAST = HORIZONS[-1] * TIME_STEP  # s
PERSON = [2.5, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
BOX = [-1.0, 0.0, 0.0, 1.0, 2.0, 0.4]  # a metre behind, its length across the robot's way
WALL = [-5.0, 0.75, 5.0, 0.75]  # alongside, to the left


def clearances(kind: str, row: list[float]) -> torch.Tensor:
    rows, masks = {kind: torch.tensor([[row]])}, {kind: torch.ones(1, 1)}
    return arc_clearances(rows, masks, GOAL).view(len(ARCS), len(HORIZONS))


def test_driving_at_a_person_closes_the_gap() -> None:
    expected = [min(1.0, 2.0 - TOP_SPEED * horizon * TIME_STEP) for horizon in HORIZONS]
    assert clearances("people", PERSON)[STRAIGHT].tolist() == pytest.approx(expected, abs=1e-6)
    assert clearances("people", PERSON)[BACK].tolist() == [1.0] * len(HORIZONS)


def test_what_was_passed_still_counts() -> None:
    passed = clearances("people", [0.3 * TOP_SPEED * LAST, 0.6, *PERSON[2:]])[STRAIGHT]
    assert passed[-1] == passed[-2] == pytest.approx(0.1, abs=0.01)


def test_backing_into_a_box() -> None:
    travelled = TOP_SPEED * HORIZONS[0] * TIME_STEP
    assert clearances("objects", BOX)[BACK, 0] == pytest.approx(1.0 - travelled - 0.2 - 0.25, abs=1e-6)
    assert clearances("objects", BOX)[BACK, -1] == pytest.approx(-0.25 - 0.2, abs=0.05)  # its middle


def test_a_wall_alongside_is_met_by_turning_towards_it() -> None:
    assert clearances("walls", WALL)[STRAIGHT].tolist() == pytest.approx([0.5] * len(HORIZONS), abs=1e-6)
    radius = TOP_SPEED / TOP_TURN_RATE
    aside = radius * (1 - math.cos(TOP_TURN_RATE * HORIZONS[1] * TIME_STEP))
    assert clearances("walls", WALL)[LEFT, 1] == pytest.approx(0.75 - aside - 0.25, abs=1e-5)


def test_nothing_is_far() -> None:
    rows, masks = {"people": torch.tensor([[PERSON]])}, {"people": torch.zeros(1, 1)}
    assert arc_clearances(rows, masks, GOAL).tolist() == [[1.0] * (len(ARCS) * len(HORIZONS))]
    assert arc_clearances({}, {}, GOAL).tolist() == [[1.0] * (len(ARCS) * len(HORIZONS))]
