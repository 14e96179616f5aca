"""Circles of people who talk: F-formations (Kendon, Conducting Interaction, 1990), as pure geometry."""

from __future__ import annotations

import math

import numpy as np

from reward_model.base.arrays import FloatArray


def circle_radius(size: int, spacing: float) -> float:
    """Radius [m] of the circle on which `size` people stand with `spacing` [m] between neighbours."""
    return spacing / (2 * math.sin(math.pi / size))


def circle_poses(middle: FloatArray, radius: float, size: int, phase: float) -> FloatArray:
    """Poses of people the same distance apart on a circle, all facing its middle. Returns (size, 3).

    Args:
        middle: (2,)
        radius: [m]
        phase: [rad] angle of the first one, counter-clockwise from the x axis
    """
    angles = phase + 2 * math.pi / size * np.arange(size)
    places = middle + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    facing = np.remainder(angles, 2 * math.pi) - math.pi  # direction to the centre, from -pi to pi
    return np.column_stack([places, facing])
