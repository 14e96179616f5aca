"""Changes of frame: from the room's axes to those of a robot standing in it (x forward, y left)."""

from __future__ import annotations

import math

import numpy as np

from reward_model.base.angles import wrap_angle
from reward_model.base.arrays import FloatArray, IntArray
from reward_model.base.numba import njit


@njit
def poses_in_frame(frame: FloatArray, poses: FloatArray) -> FloatArray:
    """Express poses (n, 3) [m, m, rad] in the frame that stands at the pose `frame` (3,)."""
    local = np.empty_like(poses)
    cosine, sine = math.cos(frame[2]), math.sin(frame[2])
    for index in range(len(poses)):
        x, y = poses[index, 0] - frame[0], poses[index, 1] - frame[1]
        local[index, 0] = cosine * x + sine * y
        local[index, 1] = cosine * y - sine * x
        local[index, 2] = wrap_angle(poses[index, 2] - frame[2])
    return local


@njit
def points_in_frame(frame: FloatArray, points: FloatArray) -> FloatArray:
    """Express points (n, 2) [m] in the frame that stands at the pose `frame` (3,)."""
    local = np.empty_like(points)
    cosine, sine = math.cos(frame[2]), math.sin(frame[2])
    for index in range(len(points)):
        x, y = points[index, 0] - frame[0], points[index, 1] - frame[1]
        local[index, 0] = cosine * x + sine * y
        local[index, 1] = cosine * y - sine * x
    return local


@njit
def turned_velocities(heading: float, velocities: FloatArray) -> FloatArray:
    """Express velocities (n, 3) [m/s, m/s, rad/s] over ground along the axes of a frame with this heading."""
    turned = np.empty_like(velocities)
    cosine, sine = math.cos(heading), math.sin(heading)
    for index in range(len(velocities)):
        x, y = velocities[index, 0], velocities[index, 1]
        turned[index, 0] = cosine * x + sine * y
        turned[index, 1] = cosine * y - sine * x
        turned[index, 2] = velocities[index, 2]
    return turned


@njit
def pose_rates(earlier: FloatArray, later: FloatArray, duration: float) -> FloatArray:
    """How fast poses (n, 3) changed on average over a duration [s], turning the short way."""
    rates = np.empty_like(later)
    for index in range(len(later)):
        rates[index, 0] = (later[index, 0] - earlier[index, 0]) / duration
        rates[index, 1] = (later[index, 1] - earlier[index, 1]) / duration
        rates[index, 2] = wrap_angle(later[index, 2] - earlier[index, 2]) / duration
    return rates


@njit
def closed_lines(corners: FloatArray) -> FloatArray:
    """(n, 4) x1, y1, x2, y2 from each of n corners to the next one and from the last to the first."""
    lines = np.empty((len(corners), 4))
    for index in range(len(corners)):
        lines[index, :2] = corners[index]
        lines[index, 2:] = corners[(index + 1) % len(corners)]
    return lines


@njit
def lines_between(pairs: IntArray, people: FloatArray, objects: FloatArray) -> FloatArray:
    """(num_pairs, 4) x1, y1, x2, y2 [m] between the two of each pair; indices count people, then objects (n, 3)."""
    lines = np.empty((len(pairs), 4))
    for index in range(len(pairs)):
        for end in range(2):
            place = pairs[index, end]
            pose = people[place] if place < len(people) else objects[place - len(people)]
            lines[index, 2 * end], lines[index, 2 * end + 1] = pose[0], pose[1]
    return lines
