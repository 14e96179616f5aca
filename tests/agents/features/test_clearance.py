"""Free distances in scenes small enough to work out by hand."""

from __future__ import annotations

import math

import pytest
import torch

from agents.features.clearance import free_distances

AHEAD, LEFT, BACK = 0.0, math.pi / 2, math.pi
PERSON = [2.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]  # two metres ahead
PASSED = [2.0, 0.51, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]  # two metres ahead and just far enough aside
BOX = [0.0, 2.0, 0.0, 1.0, 1.0, 0.4]  # two metres to the left, 1 m long that way
TURNED_BOX = [0.0, 2.0, math.sqrt(0.5), math.sqrt(0.5), 1.0, 1.0]  # its corner, widened, points to the robot
WALL = [3.0, -5.0, 3.0, 5.0]  # three metres ahead
SHORT_WALL = [3.0, 1.0, 3.0, 5.0]  # ends beside the way ahead


@pytest.mark.parametrize(
    ("kind", "row", "expected"),
    [
        ("people", PERSON, (1.5, 4.0, 4.0)),
        ("people", PASSED, (4.0, 4.0, 4.0)),
        ("objects", BOX, (4.0, 1.25, 4.0)),
        ("objects", TURNED_BOX, (4.0, 2.0 - 0.75 * math.sqrt(2), 4.0)),
        ("walls", WALL, (2.75, 4.0, 4.0)),
        ("walls", SHORT_WALL, (4.0, 4.0, 4.0)),
    ],
)
def test_distance_to_one_thing(kind: str, row: list[float], expected: tuple[float, ...]) -> None:
    rows, masks = {kind: torch.tensor([[row]])}, {kind: torch.ones(1, 1)}
    free = free_distances(rows, masks, torch.tensor([[AHEAD, LEFT, BACK]]))
    torch.testing.assert_close(free, torch.tensor([expected]), atol=1e-4, rtol=0)
    assert free_distances(rows, {kind: torch.zeros(1, 1)}, torch.tensor([[AHEAD, LEFT]])).tolist() == [[4.0, 4.0]]


def test_the_nearest_counts_and_touching_is_zero() -> None:
    rows = {"people": torch.tensor([[PERSON, [0.4, 0.0, *PERSON[2:]]]]), "walls": torch.tensor([[WALL]])}
    masks = {"people": torch.ones(1, 2), "walls": torch.ones(1, 1)}
    assert free_distances(rows, masks, torch.tensor([[AHEAD]])).tolist() == [[0.0]]


def test_a_slanting_way_to_a_wall() -> None:
    rows, masks = {"walls": torch.tensor([[WALL]])}, {"walls": torch.ones(1, 1)}
    free = free_distances(rows, masks, torch.tensor([[math.pi / 6]]))
    # The centre stops 0.25 m from the wall: (3 - 0.25) / cos 30 degrees.
    torch.testing.assert_close(free, torch.tensor([[2.75 / math.cos(math.pi / 6)]]))
