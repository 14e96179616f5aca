"""How close the robot would come to anything on the arcs that it can drive: the dynamic window's view of a scene.

The robot turns slowly, so what is free straight ahead of it does not say which turn still misses a person. For a few
pairs of speed and turn rate this follows the arc (Fox et al. 1997) and notes the least clearance on the way. As with
the free distances there is nothing to learn in here, and everybody is taken to stay where they are.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import torch
from torch import Tensor

from agents.features.clearance import (
    PERSON_RADIUS,
    ROBOT_RADIUS,
    TINY,
    Bodies,
    bodies_of,
)
from reward_model.base.arrays import Float32Array
from reward_model.base.numba import njit

TOP_SPEED = 3.5 / 9.4  # m/s, the default robot's; the observation does not tell
TOP_TURN_RATE = 4 / 10.32  # rad/s, likewise
# Shares of the top speed and of the top turn rate.
ARCS = (
    *((1.0, turn / 4) for turn in range(-4, 5)),
    *((0.5, turn) for turn in (-1.0, 1.0)),
    *((-1.0, turn) for turn in (-1.0, 0.0, 1.0)),
)
TIME_STEP = 0.4  # s between two places of an arc
NUM_PLACES = 12
HORIZONS = (2, 4, 8, 12)  # places after which the least clearance so far is told
NUM_CLEARANCES = len(ARCS) * len(HORIZONS)
FAR = 1.0  # m, clearances are cut off at this


def arc_clearances(rows: dict[str, Tensor], masks: dict[str, Tensor], goal: Tensor) -> Tensor:
    """Return the least clearance of the robot's body along each arc up to each horizon.

    Args:
        rows: people (batch, n, 8), objects (batch, n, 6) and walls (batch, n, 4), where there are any.
        masks: (batch, n) each, 1 where a row is present.
        goal: (batch, 2), for the size and the device of what is returned.

    Returns:
        (batch, num_arcs * num_horizons) [m], below 0 where bodies would overlap, at most 1.
    """
    least = np.empty((len(goal), len(ARCS), NUM_PLACES), dtype=np.float32)
    _follow(bodies_of(rows, masks, len(goal)), _places(), least)
    chosen = least[:, :, [horizon - 1 for horizon in HORIZONS]].reshape(len(goal), NUM_CLEARANCES)
    return torch.from_numpy(chosen).to(goal.device)


@cache
def _places() -> Float32Array:
    """Where the arcs lead, (2, num_arcs * NUM_PLACES) [m] x and y in the robot's frame."""
    places = np.empty((2, len(ARCS), NUM_PLACES), dtype=np.float32)
    for arc, (speed, turn) in enumerate(ARCS):
        for place in range(NUM_PLACES):
            time = TIME_STEP * (place + 1)
            half = TOP_TURN_RATE * turn * time / 2
            chord = TOP_SPEED * speed * time * (math.sin(half) / half if half else 1.0)
            places[:, arc, place] = chord * math.cos(half), chord * math.sin(half)
    return places.reshape(2, -1)


@njit
def _follow(bodies: Bodies, places: Float32Array, least: Float32Array) -> None:
    """Fill in the least clearance up to each place, (batch, num_arcs, NUM_PLACES)."""
    nearest = np.empty(places.shape[1], dtype=np.float32)
    for sample in range(len(least)):
        nearest[:] = np.float32(FAR)
        for row in range(bodies.people.shape[1]):
            if bodies.people_mask[sample, row] > 0:
                _past_person(bodies.people[sample, row], places, nearest)
        for row in range(bodies.objects.shape[1]):
            if bodies.objects_mask[sample, row] > 0:
                _past_box(bodies.objects[sample, row], places, nearest)
        for row in range(bodies.walls.shape[1]):
            if bodies.walls_mask[sample, row] > 0:
                _past_wall(bodies.walls[sample, row], places, nearest)
        flat = least[sample].reshape(-1)
        for place in range(len(nearest)):
            begins = place % NUM_PLACES == 0
            flat[place] = nearest[place] if begins else min(flat[place - 1], nearest[place])


@njit
def _past_person(row: Float32Array, places: Float32Array, nearest: Float32Array) -> None:
    """Take account of the robot's clearance from a disc at each place."""
    x, y = row[0], row[1]
    for place in range(len(nearest)):
        dx, dy = x - places[0, place], y - places[1, place]
        clearance = np.sqrt(dx * dx + dy * dy) - np.float32(ROBOT_RADIUS + PERSON_RADIUS)
        nearest[place] = min(nearest[place], clearance)


@njit
def _past_box(row: Float32Array, places: Float32Array, nearest: Float32Array) -> None:
    nothing, half = np.float32(0), np.float32(0.5)
    x, y, cosine, sine, width, depth = row[0], row[1], row[2], row[3], half * row[4], half * row[5]
    for place in range(len(nearest)):
        dx, dy = places[0, place] - x, places[1, place] - y
        along = abs(dx * cosine + dy * sine) - width
        across = abs(dy * cosine - dx * sine) - depth
        right, up = max(along, nothing), max(across, nothing)
        inside = min(max(along, across), nothing)
        clearance = np.sqrt(right * right + up * up) + inside - np.float32(ROBOT_RADIUS)
        nearest[place] = min(nearest[place], clearance)


@njit
def _past_wall(row: Float32Array, places: Float32Array, nearest: Float32Array) -> None:
    nothing, one = np.float32(0), np.float32(1)
    x, y, along_x, along_y = row[0], row[1], row[2] - row[0], row[3] - row[1]
    scale = one / (along_x * along_x + along_y * along_y + np.float32(TINY))
    for place in range(len(nearest)):
        dx, dy = places[0, place] - x, places[1, place] - y
        share = min(max((dx * along_x + dy * along_y) * scale, nothing), one)
        dx, dy = dx - share * along_x, dy - share * along_y
        clearance = np.sqrt(dx * dx + dy * dy) - np.float32(ROBOT_RADIUS)
        nearest[place] = min(nearest[place], clearance)
