"""Compiled distances in the plane, used for placement, walking and metrics.

Walls are rows x1, y1, x2, y2; discs x, y, radius; boxes x, y, cos heading, sin heading, half width, half depth.
"""

from __future__ import annotations

import math

import numpy as np

from reward_model.base.arrays import BoolArray, FloatArray
from reward_model.base.numba import njit

SIGHT_STEP = 0.1  # m between the checked points of a line


def boxes_of(poses: FloatArray, sizes: FloatArray) -> FloatArray:
    """Boxes as rows for `box_distance`. poses: (n, 3), sizes: (n, 2) width and depth. Returns (n, 6)."""
    headings = poses[:, 2:3]
    return np.hstack([poses[:, :2], np.cos(headings), np.sin(headings), sizes / 2])


@njit
def closest_on_wall(x: float, y: float, wall: FloatArray) -> tuple[float, float]:
    """The point of a wall closest to (x, y)."""
    along_x, along_y = wall[2] - wall[0], wall[3] - wall[1]
    share = ((x - wall[0]) * along_x + (y - wall[1]) * along_y) / (along_x * along_x + along_y * along_y)
    share = min(max(share, 0.0), 1.0)
    return wall[0] + share * along_x, wall[1] + share * along_y


@njit
def closest_on_box(x: float, y: float, box: FloatArray) -> tuple[float, float]:
    """The point of a box closest to (x, y); (x, y) itself if it lies inside."""
    dx, dy = x - box[0], y - box[1]
    along = min(max(box[2] * dx + box[3] * dy, -box[4]), box[4])
    across = min(max(box[2] * dy - box[3] * dx, -box[5]), box[5])
    return box[0] + box[2] * along - box[3] * across, box[1] + box[3] * along + box[2] * across


@njit
def box_distance(x: float, y: float, box: FloatArray) -> float:
    """Distance from (x, y) to the surface of a box [m], negative inside."""
    dx, dy = x - box[0], y - box[1]
    beyond = abs(box[2] * dx + box[3] * dy) - box[4]
    beside = abs(box[2] * dy - box[3] * dx) - box[5]
    if beyond > 0.0 and beside > 0.0:
        return math.hypot(beyond, beside)
    return float(max(beyond, beside))


@njit
def wall_distances(x: float, y: float, walls: FloatArray) -> FloatArray:
    """Distance from (x, y) to each wall [m]. Returns (num_walls,)."""
    distances = np.empty(len(walls))
    for index in range(len(walls)):
        near_x, near_y = closest_on_wall(x, y, walls[index])
        distances[index] = math.hypot(x - near_x, y - near_y)
    return distances


@njit
def box_distances(x: float, y: float, boxes: FloatArray) -> FloatArray:
    """Distance from (x, y) to the surface of each box [m], negative inside. Returns (num_boxes,)."""
    distances = np.empty(len(boxes))
    for index in range(len(boxes)):
        distances[index] = box_distance(x, y, boxes[index])
    return distances


@njit
def inside(x: float, y: float, walls: FloatArray) -> bool:
    """Whether (x, y) lies within the closed line of walls: a ray to the right crosses it an odd number of times."""
    odd = False
    for index in range(len(walls)):
        x1, y1, x2, y2 = walls[index]
        if (y1 > y) != (y2 > y) and x < x1 + (y - y1) / (y2 - y1) * (x2 - x1):
            odd = not odd
    return odd


@njit
def inside_each(points: FloatArray, walls: FloatArray) -> BoolArray:
    """Whether each of the points (n, 2) lies within the closed line of walls. Returns (n,)."""
    within = np.empty(len(points), dtype=np.bool_)
    for index in range(len(points)):
        within[index] = inside(points[index, 0], points[index, 1], walls)
    return within


@njit
def clearance(x: float, y: float, walls: FloatArray, discs: FloatArray, boxes: FloatArray) -> float:
    """Distance from (x, y) to the nearest surface [m], negative inside a disc or a box."""
    least = np.inf
    for wall in walls:
        near_x, near_y = closest_on_wall(x, y, wall)
        least = min(least, math.hypot(x - near_x, y - near_y))
    for disc in discs:
        least = min(least, math.hypot(x - disc[0], y - disc[1]) - disc[2])
    for box in boxes:
        least = min(least, box_distance(x, y, box))
    return least


@njit
def is_free(x: float, y: float, margin: float, walls: FloatArray, discs: FloatArray, boxes: FloatArray) -> bool:
    """Whether a body of radius `margin` fits at (x, y)."""
    return inside(x, y, walls) and clearance(x, y, walls, discs, boxes) >= margin


@njit
def line_is_free(
    start: FloatArray, end: FloatArray, margin: float, walls: FloatArray, discs: FloatArray, boxes: FloatArray
) -> bool:
    """Whether a body of radius `margin` can go straight from `start` to `end`.

    If the start has less clearance than `margin`, the clearance must not shrink until it reaches `margin`.
    """
    dx, dy = end[0] - start[0], end[1] - start[1]
    count = math.ceil(math.hypot(dx, dy) / SIGHT_STEP)
    room = clearance(start[0], start[1], walls, discs, boxes)
    for index in range(1, count + 1):
        share = index / count
        here = clearance(start[0] + share * dx, start[1] + share * dy, walls, discs, boxes)
        if here < margin and here < room:
            return False
        room = max(room, here)
    return True


@njit
def first_free(places: FloatArray, margin: float, walls: FloatArray, discs: FloatArray, boxes: FloatArray) -> int:
    """Index of the first of `places` (n, 2) where a body of radius `margin` [m] fits; -1 if there is none."""
    for index in range(len(places)):
        if is_free(places[index, 0], places[index, 1], margin, walls, discs, boxes):
            return index
    return -1


@njit
def first_free_pair(
    firsts: FloatArray,
    seconds: FloatArray,
    first_margin: float,
    second_margin: float,
    sight: float,
    walls: FloatArray,
    discs: FloatArray,
    boxes: FloatArray,
) -> int:
    """Index of the first pair of places, (n, 2) each, where two bodies fit in sight of each other; -1 if none.

    Args:
        sight: [m] clearance on both sides of the line between the two
    """
    for index in range(len(firsts)):
        first, second = firsts[index], seconds[index]
        if (
            is_free(first[0], first[1], first_margin, walls, discs, boxes)
            and is_free(second[0], second[1], second_margin, walls, discs, boxes)
            and line_is_free(first, second, sight, walls, discs, boxes)
        ):
            return index
    return -1
