"""Planar poses: seen from one another, and along the arc that a constant command drives.

A pose is x [m], y [m], heading [rad], counter-clockwise. Headings are added and subtracted, never wrapped, so that
the difference of two is a turn.
"""

from __future__ import annotations

import numpy as np

from reward_model.base.arrays import FloatArray


def rotated(points: FloatArray, angle: float) -> FloatArray:
    """Turn points (..., 2) about the origin, counter-clockwise."""
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y = points[..., 0], points[..., 1]
    return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)


def seen_from(viewpoint: FloatArray, poses: FloatArray) -> FloatArray:
    """Poses (..., 3) in the frame of a viewpoint (3,), which is given in the same frame as they are."""
    places = rotated(poses[..., :2] - viewpoint[:2], -viewpoint[2])
    return np.concatenate([places, poses[..., 2:] - viewpoint[2]], axis=-1)


def placed_at(viewpoint: FloatArray, poses: FloatArray) -> FloatArray:
    """Poses (..., 3) given in the frame of a viewpoint (3,), in the frame that the viewpoint is given in."""
    places = rotated(poses[..., :2], viewpoint[2]) + viewpoint[:2]
    return np.concatenate([places, poses[..., 2:] + viewpoint[2]], axis=-1)


def driven(forward: float, turn: float, duration: float) -> FloatArray:
    """(3,) where a constant forward speed [m/s] and turn rate [rad/s] lead from the origin.

    duration: [s]; a negative one says where the drive to the origin came from
    """
    angle = turn * duration
    chord = forward * duration * np.sinc(angle / (2 * np.pi))  # of the arc, which it leaves at half the angle
    return np.array([chord * np.cos(angle / 2), chord * np.sin(angle / 2), angle])


def aligned(points: FloatArray, others: FloatArray) -> FloatArray:
    """(3,) the pose from which points fixed in the room look as they do, in the frame that sees them as `others`.

    points, others: (num_points, 2) [m] the same points in the two frames; their distances are met as closely as one
    rotation and one shift can (least squares)
    """
    centre, other_centre = points.mean(axis=0), others.mean(axis=0)
    first, second = points - centre, others - other_centre
    cross = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]).sum()
    angle = np.arctan2(cross, (first * second).sum())
    return np.array([*(other_centre - rotated(centre, angle)), angle])
