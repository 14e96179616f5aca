"""Rooms as SONATA makes them, and a check of the robot's way through one."""

from __future__ import annotations

import math

import numpy as np

from reward_model.base.arrays import FloatArray
from reward_model.base.numba import njit
from socnav_env.config import L_SHAPE, SQUARE, RoomConfig
from socnav_env.geometry.distances import clearance
from socnav_env.layout import Room

CELL = 0.2  # m, grid spacing of the check for reachability
NEIGHBOURS = ((1, 0), (0, 1), (-1, 0), (0, -1))


def sample_room(config: RoomConfig, rng: np.random.Generator) -> Room:
    """A random room of one of the configured kinds, centred at the origin."""
    room = _sample_upright(config, rng)
    if not config.turned:
        return room
    angle = rng.uniform(-math.pi, math.pi)
    cosine, sine = math.cos(angle), math.sin(angle)
    return Room(room.corners @ np.array([[cosine, sine], [-sine, cosine]]))


def _sample_upright(config: RoomConfig, rng: np.random.Generator) -> Room:
    if config.kind_weights:
        weights = np.array(config.kind_weights, dtype=np.float64)
        kind = config.kinds[rng.choice(len(config.kinds), p=weights / weights.sum())]
    else:
        kind = config.kinds[rng.integers(len(config.kinds))]
    if kind == L_SHAPE:
        return l_room(_draw(config.l_unit, rng))
    if kind == SQUARE:
        side = _draw(config.square_side, rng)
        return rectangular_room(side, side)
    breadth = _draw(config.rectangle_side, rng)
    return rectangular_room(_draw((breadth, config.rectangle_side[1]), rng), breadth)


def rectangular_room(length: float, breadth: float) -> Room:
    """A room with four walls: `length` along x, `breadth` along y [m]."""
    x, y = length / 2, breadth / 2
    return Room(np.array([[-x, -y], [x, -y], [x, y], [-x, y]]))


def l_room(unit: float) -> Room:
    """A square room of three by three units without the corner of two units by one at the lower left [m]."""
    near, far = unit / 2, 1.5 * unit
    return Room(np.array([[near, -far], [far, -far], [far, far], [-far, far], [-far, -near], [near, -near]]))


def _draw(limits: tuple[int, int], rng: np.random.Generator) -> int:
    return int(rng.integers(limits[0], limits[1] + 1))


@njit
def is_reachable(
    start: FloatArray,
    goal: FloatArray,
    within: float,
    radius: float,
    walls: FloatArray,
    discs: FloatArray,
    boxes: FloatArray,
) -> bool:
    """Whether a round robot can get from `start` to less than `within` [m] of `goal` past all obstacles.

    Flood fill of a grid with spacing `CELL` that includes `start`. A place counts as free if the robot has half a cell
    of extra clearance there, so that it fits everywhere between two free neighbours. Passages that leave less than that
    are not found. `start` itself counts as free.
    """
    left, bottom = walls[:, 0].min(), walls[:, 1].min()
    before_x = math.floor((start[0] - left) / CELL)
    before_y = math.floor((start[1] - bottom) / CELL)
    columns = before_x + 1 + math.floor((walls[:, 0].max() - start[0]) / CELL)
    rows = before_y + 1 + math.floor((walls[:, 1].max() - start[1]) / CELL)
    seen = np.zeros((columns, rows), dtype=np.bool_)
    queue = np.empty((columns * rows, 2), dtype=np.int64)
    queue[0] = before_x, before_y
    seen[before_x, before_y] = True
    first, last = 0, 1
    while first < last:
        column, row = queue[first]
        first += 1
        x, y = start[0] + (column - before_x) * CELL, start[1] + (row - before_y) * CELL
        if math.hypot(goal[0] - x, goal[1] - y) < within:
            return True
        for right, up in NEIGHBOURS:
            next_column, next_row = column + right, row + up
            if not (0 <= next_column < columns and 0 <= next_row < rows) or seen[next_column, next_row]:
                continue
            seen[next_column, next_row] = True
            x, y = start[0] + (next_column - before_x) * CELL, start[1] + (next_row - before_y) * CELL
            if clearance(x, y, walls, discs, boxes) >= radius + CELL / 2:
                queue[last] = next_column, next_row
                last += 1
    return False
