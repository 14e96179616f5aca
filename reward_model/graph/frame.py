"""The graph of one snapshot, as arrays or packed into words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reward_model.base.arrays import Float32Array, Int32Array, IntArray
from reward_model.graph.packing import FrameArrays, Stack, packed, unpacked, views


class Surroundings(NamedTuple):
    """What a frame keeps of the scene's geometry beside its nodes; distances are from the robot's centre.

    Attributes:
        person: [m] to the closest person's centre
        object: [m] to the closest object's outline, 0 inside it
        wall: [m] to the closest wall
        extent: [m] the larger of the room's widths along its longest wall and across it

    Distances are infinite, and the extent 0, where there is nothing of the kind or nothing is known.
    """

    person: float
    object: float
    wall: float
    extent: float


UNKNOWN_SURROUNDINGS = Surroundings(np.inf, np.inf, np.inf, 0.0)


class FrameGraph:
    """The graph of one snapshot. Room edges and self edges are implied: every node has them.

    It stores its arrays, or one array of words that they are packed into, and computes the other form on access.

    Args:
        features: (num_nodes, 42) with the three time features zero; nodes are the room, people, objects, the goal and
            wall segments, in this order
        kinds: (num_nodes,) of `NodeKind`
        keys: (num_nodes,) the same for an entity in every frame of a scene, unique within a frame
        lengths: (num_nodes,) [dam] from the robot, 0 for the room: the length of the room edges
        link_sources, link_targets: (num_links,) node indices of the edges between people, objects and walls
        link_relations: (num_links,) of `Relation`
        link_lengths: (num_links,) [dam] between people and objects, [m] between a person and a wall
        surroundings: (4,) the fields of `Surroundings`, no part of the graph; unknown by default
    """

    __slots__ = ("_arrays", "_words")

    def __init__(
        self,
        features: Float32Array,
        kinds: Int32Array,
        keys: IntArray,
        lengths: Float32Array,
        link_sources: Int32Array,
        link_targets: Int32Array,
        link_relations: Int32Array,
        link_lengths: Float32Array,
        surroundings: Float32Array | None = None,
    ) -> None:
        if surroundings is None:
            surroundings = np.array(UNKNOWN_SURROUNDINGS, dtype=np.float32)
        self._arrays: FrameArrays | None = FrameArrays(
            features, kinds, keys, lengths, link_sources, link_targets, link_relations, link_lengths, surroundings
        )
        self._words: Int32Array | None = None

    @classmethod
    def of_words(cls, words: Int32Array) -> FrameGraph:
        """The frame packed into words, see `reward_model.graph.packing`."""
        frame = cls.__new__(cls)
        frame._arrays, frame._words = None, words
        return frame

    @property
    def arrays(self) -> FrameArrays:
        """All arrays; those of a packed frame are copies."""
        if self._arrays is not None:
            return self._arrays
        assert self._words is not None
        return unpacked(self._words)

    @property
    def words(self) -> Int32Array:
        """The packed form."""
        if self._words is None:
            assert self._arrays is not None
            self._words = packed(self._arrays)
        return self._words

    def replaced(self, **changes: NDArray[np.generic]) -> FrameGraph:
        """The same frame with other arrays, by name."""
        return FrameGraph(*self.arrays._replace(**changes))  # type: ignore[arg-type]

    @property
    def surroundings(self) -> Surroundings:
        """Distances from the robot, and the room's extent."""
        stored = self._arrays.surroundings if self._arrays is not None else views(self.words).surroundings
        return Surroundings(*stored.tolist())

    @property
    def num_links(self) -> int:
        """The number of links."""
        return len(self._arrays.link_lengths) if self._arrays is not None else int(self.words[1])

    def __len__(self) -> int:
        return len(self._arrays.kinds) if self._arrays is not None else int(self.words[0])


def stack_windows(windows: Sequence[Sequence[FrameGraph]]) -> Stack:
    """Concatenate the frames of windows, newest first."""
    words = [frame.words for window in windows for frame in window]
    return Stack(np.concatenate(words), np.array([len(window) for window in windows]))
