"""Where a ray first meets something: exact intersections, compiled.

A ray starts at (x, y) and runs along the unit vector (dx, dy). Every answer is a distance [m]: 0 where the ray starts
inside, infinite where it never arrives. Arrays are passed whole, with the index of the row that is meant: views of rows
cost more than all the arithmetic.
"""

from __future__ import annotations

import math

import numpy as np

from reward_model.base.angles import wrap_angle
from reward_model.base.arrays import BoolArray, FloatArray
from reward_model.base.numba import njit

PARALLEL = 1e-12  # sine of the angle below which a ray misses a line
SAME_PLACE = 1e-9  # m by which something must be nearer to hide something


@njit
def ray_to_wall(x: float, y: float, dx: float, dy: float, walls: FloatArray, index: int) -> float:
    """To one of the lines (n, 4) from x1, y1 to x2, y2."""
    along_x, along_y = walls[index, 2] - walls[index, 0], walls[index, 3] - walls[index, 1]
    cross = dx * along_y - dy * along_x
    if abs(cross) < PARALLEL:
        return np.inf
    to_x, to_y = walls[index, 0] - x, walls[index, 1] - y
    distance = (to_x * along_y - to_y * along_x) / cross
    share = (to_x * dy - to_y * dx) / cross
    return distance if distance >= 0.0 and 0.0 <= share <= 1.0 else np.inf


@njit
def ray_to_disc(x: float, y: float, dx: float, dy: float, discs: FloatArray, index: int) -> float:
    """To one of the discs (n, 3) x, y, radius."""
    to_x, to_y = discs[index, 0] - x, discs[index, 1] - y
    outside = to_x * to_x + to_y * to_y - discs[index, 2] * discs[index, 2]
    if outside <= 0.0:
        return 0.0
    ahead = to_x * dx + to_y * dy
    reach = ahead * ahead - outside
    return ahead - math.sqrt(reach) if ahead > 0.0 and reach >= 0.0 else np.inf


@njit
def ray_to_box(x: float, y: float, dx: float, dy: float, boxes: FloatArray, index: int) -> float:
    """To one of the boxes (n, 6), see `geometry.boxes_of`."""
    from_x, from_y = x - boxes[index, 0], y - boxes[index, 1]
    cosine, sine = boxes[index, 2], boxes[index, 3]
    near_1, far_1 = _slab(cosine * from_x + sine * from_y, cosine * dx + sine * dy, boxes[index, 4])
    near_2, far_2 = _slab(cosine * from_y - sine * from_x, cosine * dy - sine * dx, boxes[index, 5])
    near, far = max(near_1, near_2), min(far_1, far_2)
    if far < 0.0 or near > far:
        return np.inf
    return max(near, 0.0)


@njit
def _slab(start: float, speed: float, half_width: float) -> tuple[float, float]:
    """From where to where along a ray its coordinate lies within half_width of 0."""
    if abs(speed) < PARALLEL:
        return (-np.inf, np.inf) if abs(start) <= half_width else (np.inf, -np.inf)
    one, other = (-half_width - start) / speed, (half_width - start) / speed
    return min(one, other), max(one, other)


@njit
def ray_distances(
    x: float, y: float, headings: FloatArray, longest: float, walls: FloatArray, discs: FloatArray, boxes: FloatArray
) -> FloatArray:
    """To the first thing in each direction, at most `longest`.

    Args:
        headings: (n,) [rad]
        walls: (num_walls, 4)
        discs: (num_discs, 3)
        boxes: (num_boxes, 6)

    Returns:
        (n,).
    """
    distances = np.full(len(headings), longest)
    for index in range(len(headings)):
        dx, dy = math.cos(headings[index]), math.sin(headings[index])
        least = longest
        for wall in range(len(walls)):
            least = min(least, ray_to_wall(x, y, dx, dy, walls, wall))
        for disc in range(len(discs)):
            least = min(least, ray_to_disc(x, y, dx, dy, discs, disc))
        for box in range(len(boxes)):
            least = min(least, ray_to_box(x, y, dx, dy, boxes, box))
        distances[index] = least
    return distances


@njit
def in_view(
    pose: FloatArray,
    places: FloatArray,
    field_of_view: float,
    longest: float,
    occlusion: bool,
    walls: FloatArray,
    discs: FloatArray,
    boxes: FloatArray,
) -> BoolArray:
    """Which places are seen from a pose (3,).

    Args:
        places: (n, 2 or more) centres of the discs, then of the boxes; none hides itself, nor a box what stands on it
        field_of_view: [rad]
        longest: [m]
        occlusion: whether things hide what lies behind them
    """
    seen = np.zeros(len(places), dtype=np.bool_)
    for index in range(len(places)):
        to_x, to_y = places[index, 0] - pose[0], places[index, 1] - pose[1]
        distance = math.hypot(to_x, to_y)
        bearing = abs(wrap_angle(math.atan2(to_y, to_x) - pose[2]))
        if distance > longest or bearing > field_of_view / 2.0:
            continue
        seen[index] = not occlusion or not _hidden(
            pose[0], pose[1], to_x / distance, to_y / distance, distance, index, walls, discs, boxes
        )
    return seen


@njit
def _hidden(
    x: float,
    y: float,
    dx: float,
    dy: float,
    distance: float,
    itself: int,
    walls: FloatArray,
    discs: FloatArray,
    boxes: FloatArray,
) -> bool:
    """Whether something stands before a place; `itself`: the number of the disc or, after those, the box there."""
    distance -= SAME_PLACE
    for index in range(len(walls)):
        if ray_to_wall(x, y, dx, dy, walls, index) < distance:
            return True
    for index in range(len(discs)):
        if index != itself and ray_to_disc(x, y, dx, dy, discs, index) < distance:
            return True
    end_x, end_y = x + dx * distance, y + dy * distance
    for index in range(len(boxes)):
        if index + len(discs) != itself and ray_to_box(x, y, dx, dy, boxes, index) < distance:
            stands_on_it = ray_to_box(end_x, end_y, 1.0, 0.0, boxes, index) == 0.0
            if not stands_on_it:
                return True
    return False
