"""The protocols of observations, and helpers that the kinds of observation share."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from gymnasium import spaces

from reward_model.base.arrays import Float32Array
from reward_model.base.numba import njit

if TYPE_CHECKING:
    from reward_model.graph.frame import FrameGraph
    from socnav_env.config import EnvConfig, RoomConfig
    from socnav_env.simulation.world import World

Bounds = list[tuple[float, float]]  # minimum and maximum of each number

MAX_SPEED = 5.0  # m/s, bound of the box; nobody in a room is faster
MAX_TURN_RATE = 4 * math.pi  # rad/s, likewise
MOTION: Bounds = [(-MAX_SPEED, MAX_SPEED)] * 2 + [(-MAX_TURN_RATE, MAX_TURN_RATE)]
SHARE: Bounds = [(0.0, 1.0)]
ROBOT: Bounds = MOTION + SHARE  # speeds, turn rate, share of the time that is left


@runtime_checkable
class Observation(Protocol):
    """The protocol of a kind of observation."""

    def space(self) -> spaces.Space[Any]:
        """Return the space that contains all observations."""

    def observe(self, world: World, time_left: float) -> Any:
        """Return the current observation in new arrays. time_left: share of the episode's time, 0..1."""


@runtime_checkable
class RowObservation(Observation, Protocol):
    """An observation with a fixed number of values, which vector environments write in place."""

    @property
    def size(self) -> int:
        """The number of values."""

    def write(self, world: World, time_left: float, row: Float32Array) -> None:
        """Write the current observation into `row`, (size,), all of it."""

    def unpack(self, rows: Float32Array) -> Any:
        """Return the observations in one row (size,) or in many, (n, size), in new arrays."""


@runtime_checkable
class WindowObservation(Protocol):
    """A kind of observation that also reads the frames scored for the last second."""

    def space(self) -> spaces.Space[Any]:
        """Return the space that contains all observations."""

    def observe_window(self, world: World, time_left: float, window: Sequence[FrameGraph]) -> Any:
        """Return the current observation in new arrays. window: one to three frames, newest first."""


class Parts:
    """Named parts of a row of numbers, and their bounds.

    starts: (num_parts,) index at which each part begins
    size: length of the whole row

    Args:
        bounds: minimum and maximum of each number, by name of the part
    """

    def __init__(self, bounds: Mapping[str, Bounds]) -> None:
        pairs = np.array([pair for part in bounds.values() for pair in part], dtype=np.float32)
        self.low, self.high = np.ascontiguousarray(pairs[:, 0]), np.ascontiguousarray(pairs[:, 1])
        self.size = len(pairs)
        ends = np.cumsum([0, *(len(part) for part in bounds.values())])
        self.starts = ends[:-1]
        places = zip(bounds, pairwise(ends.tolist()), strict=True)
        self.slices = {name: slice(*pair) for name, pair in places if pair[1] > pair[0]}

    def space(self) -> spaces.Dict:
        """Return a box for each part; a part without numbers has none."""
        return spaces.Dict(
            {name: spaces.Box(self.low[part], self.high[part], dtype=np.float32) for name, part in self.slices.items()}
        )

    def split(self, rows: Float32Array) -> dict[str, Float32Array]:
        """Return the parts of one row (size,) or of many, (n, size), as views."""
        return {name: rows[..., part] for name, part in self.slices.items()}

    def clip(self, row: Float32Array) -> None:
        """Clip the numbers to their bounds, in place."""
        _clip(row, self.low, self.high)


def longest_sight(room: RoomConfig) -> float:
    """Maximum distance [m] between two points of a room that the config allows."""
    side = max(room.square_side[1], room.rectangle_side[1], 3 * room.l_unit[1])
    return math.sqrt(2) * side


def place_bounds(config: EnvConfig) -> Bounds:
    """Bounds of x and y in the robot's frame [m]."""
    sight = longest_sight(config.room)
    return [(-sight, sight)] * 2


@njit
def _clip(values: Float32Array, low: Float32Array, high: Float32Array) -> None:
    for index in range(len(values)):
        if values[index] < low[index]:
            values[index] = low[index]
        elif values[index] > high[index]:
            values[index] = high[index]
