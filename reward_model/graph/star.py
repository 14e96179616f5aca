"""Windows seen from the robot: each entity's three frames side by side in one row, `Stars`.

What the three-frame graph says by temporal edges (the same entity one second ago) stands in a row here, and room edges
are implied, so a network on stars needs no edge but those between interacting entities. It keeps all that the frames
say of the newest frame's entities. An entity that an older frame lacks stands still there; an older frame that is
missing is the one after it.

A row's first columns are even, its last ones odd: swapping left and right changes the sign of the odd ones alone.
A wall's direction is written as that of twice its angle, which is the same from either of its ends.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np

from reward_model.base.arrays import Float32Array, IntArray
from reward_model.graph.frame import FrameGraph, stack_windows
from reward_model.graph.star_kernels import (
    ENTITY_ODD,
    OBJECT_EVEN,
    PAIR_EVEN,
    PAIR_ODD,
    PERSON_EVEN,
    ROOM_EVEN,
    ROOM_ODD,
    WALL_EVEN,
    WALL_ODD,
    Rows,
    star_rows,
)

KINDS: Final = ("people", "objects", "walls", "pairs")
"""The kinds of rows that a window has any number of, in the order of the counts."""

WIDTHS: Final[Mapping[str, tuple[int, int]]] = {
    "people": (PERSON_EVEN, ENTITY_ODD),
    "objects": (OBJECT_EVEN, ENTITY_ODD),
    "walls": (WALL_EVEN, WALL_ODD),
    "pairs": (PAIR_EVEN, PAIR_ODD),
    "rooms": (ROOM_EVEN, ROOM_ODD),
}
"""The numbers of even and of odd columns of each kind of rows."""


@dataclass(frozen=True, eq=False)
class Stars(Sequence[Any]):
    """The rows of several windows, those of one window after those of the one before it.

    Attributes:
        people: (num_people, 29) three frames of y, vy, sin a, distance; the distance to the closest wall segment near
            it (0.15 if there is none), their number / 10, whether it interacts, exp(-distance / 0.05) and
            exp(-distance / 0.15); three frames of x, va, vx, cos a
        objects: (num_objects, 28) as of people, with the sizes in place of walls and interaction
        walls: (num_segments, 17) three frames of y, cos 2o, distance; both exponentials; three frames of x, sin 2o
        pairs: (num_pairs, 44) of a person and whom or what they interact with: three frames of both y, the robot's
            distance from the line between them, s (1 - s) for its place s along it, both distances and vy; the length
            of the line, whether the other is an object, both sin a, exponentials of the robot's distance from the
            line; three frames of both x and vx; both cos a. Two people make a pair each way
        rooms: (num_windows, 41) three frames of the goal's y and distance, advance; people / 15 and its square,
            segments / 50, objects / 10, pairs / 5, 10 / (nodes of the newest frame), exponentials of the goal's
            distance; in each frame the distances d [m] to the closest person, object and wall, at most 3, each with
            exp((0.25 - d) / 0.15); three frames of the goal's x, turn
        counts: (num_windows, 4) of people, objects, wall segments and pairs
        surroundings: (num_windows, 4) the newest frame's, see `FrameGraph`

    Numbers are those of the frames' features: decametres, x to the right, y forward, nothing beyond 10 km.
    """

    people: Float32Array
    objects: Float32Array
    walls: Float32Array
    pairs: Float32Array
    rooms: Float32Array
    counts: IntArray
    surroundings: Float32Array

    @classmethod
    def of_windows(cls, windows: Sequence[Sequence[FrameGraph]]) -> Stars:
        """The rows of windows of one to three frames each, newest first; `Stars` are returned as they are."""
        if isinstance(windows, Stars):
            return windows
        if not windows:
            return cls.joined([])
        return cls(*star_rows(stack_windows(windows)))

    @classmethod
    def joined(cls, parts: Sequence[Stars]) -> Stars:
        """The windows of all parts, one after the other."""
        empty = cls(
            **{name: np.zeros((0, sum(widths)), dtype=np.float32) for name, widths in WIDTHS.items()},
            counts=np.zeros((0, len(KINDS)), dtype=np.int64),
            surroundings=np.zeros((0, 4), dtype=np.float32),
        )
        return cls(*(np.concatenate([getattr(each, name) for each in (empty, *parts)]) for name in Rows._fields))

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, Any]) -> Stars:
        """The inverse of `arrays`."""
        return cls(*(arrays[name] for name in Rows._fields))

    def arrays(self) -> dict[str, Any]:
        """All arrays by name."""
        return {name: getattr(self, name) for name in Rows._fields}

    def __len__(self) -> int:
        return len(self.counts)

    def __getitem__(self, index: Any) -> Any:
        return self.taken(np.atleast_1d(np.arange(len(self))[index]))

    def taken(self, chosen: IntArray) -> Stars:
        """The windows at these places, in this order."""
        starts = self._starts
        rows = {}
        for column, kind in enumerate(KINDS):
            count = self.counts[chosen, column]
            ends = np.cumsum(count)
            first = np.repeat(starts[chosen, column] - (ends - count), count)
            rows[kind] = getattr(self, kind)[first + np.arange(len(first))]
        return Stars(
            **rows, rooms=self.rooms[chosen], counts=self.counts[chosen], surroundings=self.surroundings[chosen]
        )

    @cached_property
    def _starts(self) -> IntArray:
        starts: IntArray = np.cumsum(self.counts, axis=0) - self.counts
        return starts
