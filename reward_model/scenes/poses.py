"""Planar poses: changes of frame, and motion along the arc of a constant command.

A pose is x [m], y [m], heading [rad], counter-clockwise. Headings are added and subtracted, never wrapped, so that
the difference of two is a turn.
"""

from __future__ import annotations

import numpy as np

from reward_model.base.arrays import FloatArray


def rotated(points: FloatArray, angle: float) -> FloatArray:
    """Rotate points (..., 2) about the origin, counter-clockwise [rad]."""
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y = points[..., 0], points[..., 1]
    return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)


def seen_from(viewpoint: FloatArray, poses: FloatArray) -> FloatArray:
    """Poses (..., 3) transformed into the frame of a viewpoint (3,); both are given in the same frame."""
    places = rotated(poses[..., :2] - viewpoint[:2], -viewpoint[2])
    return np.concatenate([places, poses[..., 2:] - viewpoint[2]], axis=-1)


def placed_at(viewpoint: FloatArray, poses: FloatArray) -> FloatArray:
    """Poses (..., 3) transformed from the frame of a viewpoint (3,) into the frame that the viewpoint is given in."""
    places = rotated(poses[..., :2], viewpoint[2]) + viewpoint[:2]
    return np.concatenate([places, poses[..., 2:] + viewpoint[2]], axis=-1)


def driven(forward: float, turn: float, duration: float) -> FloatArray:
    """The pose (3,) after driving from the origin at a constant forward speed [m/s] and turn rate [rad/s].

    Args:
        duration: [s]; a negative one gives the pose from which the origin is reached
    """
    angle = turn * duration
    chord = forward * duration * np.sinc(angle / (2 * np.pi))  # of the arc; its direction is half the angle
    return np.array([chord * np.cos(angle / 2), chord * np.sin(angle / 2), angle])


def aligned(points: FloatArray, others: FloatArray) -> FloatArray:
    """The pose (3,) of the frame of `points` in the frame of `others`, which are the same points fixed in the room.

    Args:
        points, others: (num_points, 2) [m] the points in the two frames; one rotation and one shift are fitted to them
            by least squares
    """
    centre, other_centre = points.mean(axis=0), others.mean(axis=0)
    first, second = points - centre, others - other_centre
    cross = (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]).sum()
    angle = np.arctan2(cross, (first * second).sum())
    return np.array([*(other_centre - rotated(centre, angle)), angle])
