"""Angles brought back to one turn [rad].

Three forms, which differ in the last bits or at half a turn: `wrap_angle` for the angle from one direction to another;
`wrap_angles` for an array of such; `wrap_heading` for a direction itself, where half a turn keeps its sign.
"""

from __future__ import annotations

import math

import numpy as np

from reward_model.base.arrays import FloatArray
from reward_model.base.numba import njit


@njit
def wrap_angle(angle: float) -> float:
    """The same angle in [-pi, pi); half a turn is -pi."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


def wrap_angles(angles: FloatArray) -> FloatArray:
    """The same angles in [-pi, pi), an array of any shape; half a turn is -pi.

    Not to the last bit what `wrap_angle` gives: adding pi and taking it off again rounds angles that are small.
    """
    return np.remainder(angles + np.pi, 2 * np.pi) - np.pi


@njit
def wrap_heading(heading: float) -> float:
    """The same heading in [-pi, pi]: pi stays pi and -pi stays -pi, and so does all that lies between, to the last bit.

    For eight turns it is what `math.remainder` gives, except that a zero is positive. Not `wrap_angle`, which turns the
    heading pi, that scenarios begin with, into -pi: its sine has the other sign.
    """
    wrapped: float = heading - 2.0 * math.pi * np.rint(heading / (2.0 * math.pi))
    return wrapped
