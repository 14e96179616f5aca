"""How far the robot could drive straight on in every direction before it touches something.

Computed from the rows of the `entities` observation, in compiled code without anything to learn. A small network that
sees positions alone takes millions of steps to work this out; steering around people needs it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from reward_model.base.arrays import Float32Array
from reward_model.base.numba import njit

ROBOT_RADIUS = 0.25  # m, the default robot's; the observation does not tell
PERSON_RADIUS = 0.25  # m, likewise
SIGHT = 4.0  # m, free distances are cut off at this
TINY = 1e-6
WIDTHS = {"people": 8, "objects": 6, "walls": 4}  # of the rows of what a robot can run into


class Bodies(NamedTuple):
    """What a robot can run into, as `entities` lists it: (batch, n, 8), (batch, n, 6), (batch, n, 4), (batch, n) each.

    Boxes are given as x, y of their centre, cosine and sine of their heading, width along it and depth.
    """

    people: Float32Array
    objects: Float32Array
    walls: Float32Array
    people_mask: Float32Array
    objects_mask: Float32Array
    walls_mask: Float32Array


def bodies_of(rows: dict[str, Tensor], masks: dict[str, Tensor], batch: int) -> Bodies:
    """Gather the rows and masks, where there are any, in memory that compiled code reads."""
    things = [_array(rows[kind]) if kind in rows else np.zeros((batch, 0, width)) for kind, width in WIDTHS.items()]
    present = [_array(masks[kind]) if kind in rows else np.zeros((batch, 0)) for kind in WIDTHS]
    return Bodies(*(np.ascontiguousarray(each, dtype=np.float32) for each in (*things, *present)))


def free_distances(rows: dict[str, Tensor], masks: dict[str, Tensor], headings: Tensor) -> Tensor:
    """Return how far the robot's body can move along each heading.

    Args:
        rows: people (batch, n, 8), objects (batch, n, 6) and walls (batch, n, 4), where there are any.
        masks: (batch, n) each, 1 where a row is present.
        headings: (batch, num_headings) [rad] in the robot's frame.

    Returns:
        (batch, num_headings) [m], from 0 to 4.
    """
    ways = torch.stack([headings.cos(), headings.sin()], dim=1)
    free = np.empty(tuple(headings.shape), dtype=np.float32)
    _look(bodies_of(rows, masks, len(headings)), np.ascontiguousarray(_array(ways), dtype=np.float32), free)
    return torch.from_numpy(free).to(headings.device)


def _array(tensor: Tensor) -> Float32Array:
    array: Float32Array = tensor.detach().cpu().numpy()
    return array


@njit
def _look(bodies: Bodies, ways: Float32Array, free: Float32Array) -> None:
    """Fill in how far the robot gets along each of `ways`, (batch, 2, num_headings) cosines and sines."""
    for sample in range(len(free)):
        nearest, cosines, sines = free[sample], ways[sample, 0], ways[sample, 1]
        nearest[:] = np.float32(SIGHT)
        for row in range(bodies.people.shape[1]):
            if bodies.people_mask[sample, row] > 0:
                _to_person(bodies.people[sample, row], cosines, sines, nearest)
        for row in range(bodies.objects.shape[1]):
            if bodies.objects_mask[sample, row] > 0:
                _to_box(bodies.objects[sample, row], cosines, sines, nearest)
        for row in range(bodies.walls.shape[1]):
            if bodies.walls_mask[sample, row] > 0:
                _to_wall(bodies.walls[sample, row], cosines, sines, nearest)
        for heading in range(len(nearest)):
            nearest[heading] = max(nearest[heading], np.float32(0))


@njit
def _to_person(row: Float32Array, cosines: Float32Array, sines: Float32Array, nearest: Float32Array) -> None:
    """Take account of the distances to touching a disc, along headings that lead there."""
    x, y, reach = row[0], row[1], np.float32(ROBOT_RADIUS + PERSON_RADIUS)
    for heading in range(len(nearest)):
        along = x * cosines[heading] + y * sines[heading]
        aside = y * cosines[heading] - x * sines[heading]
        chord = reach * reach - aside * aside
        if chord > 0 and along > 0:
            nearest[heading] = min(nearest[heading], along - np.sqrt(chord))


@njit
def _to_box(row: Float32Array, cosines: Float32Array, sines: Float32Array, nearest: Float32Array) -> None:
    """Likewise of a box, widened by the robot's radius, by the slab method (Kay & Kajiya 1986)."""
    x, y, cosine, sine = row[0], row[1], row[2], row[3]
    width, depth = row[4] / 2 + np.float32(ROBOT_RADIUS), row[5] / 2 + np.float32(ROBOT_RADIUS)
    along, across = x * cosine + y * sine, y * cosine - x * sine
    for heading in range(len(nearest)):
        first = _slowness(cosines[heading] * cosine + sines[heading] * sine)
        second = _slowness(sines[heading] * cosine - cosines[heading] * sine)
        enter = max(along * first - width * abs(first), across * second - depth * abs(second))
        leave = min(along * first + width * abs(first), across * second + depth * abs(second))
        if leave > enter and leave > 0:
            nearest[heading] = min(nearest[heading], enter)


@njit
def _slowness(step: np.float32) -> np.float32:
    return np.float32(1) / (np.float32(TINY) if abs(step) < np.float32(TINY) else step)


@njit
def _to_wall(row: Float32Array, cosines: Float32Array, sines: Float32Array, nearest: Float32Array) -> None:
    """Likewise of touching the line of a wall, where the robot's centre would cross the wall."""
    x, y, along_x, along_y = row[0], row[1], row[2] - row[0], row[3] - row[1]
    length = np.sqrt(along_x * along_x + along_y * along_y)
    for heading in range(len(nearest)):
        slowness = _slowness(cosines[heading] * along_y - sines[heading] * along_x)
        distance = (x * along_y - y * along_x) * slowness
        share = (x * sines[heading] - y * cosines[heading]) * slowness
        if distance > 0 and 0 <= share <= 1:
            nearest[heading] = min(nearest[heading], distance - np.float32(ROBOT_RADIUS) * length * abs(slowness))
