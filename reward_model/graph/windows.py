"""Graphs of the last three seconds of a scene, the input of the published network.

The layout is that of Bachiller et al. 2021, on which their released network was trained. A `FrameGraph` is one
snapshot: nodes, and the edges among them. A `SceneGraph` is up to three frames one second apart, newest first,
joined by temporal edges. Frames do not depend on their place in the window, so each is made once and shared by
all windows that contain it.

Features and their conventions are in `features`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from reward_model.base.arrays import Float32Array, FloatArray, Int32Array, IntArray
from reward_model.graph.features import (
    FRAME_SPACING,
    FROM_ROOM,
    LENGTH_FEATURE,
    MIRROR_SIGNS,
    NUM_EDGE_FEATURES,
    NUM_FRAMES,
    NUM_NODE_FEATURES,
    TIME_FEATURES,
    TO_ROOM,
    WALL_DIRECTION,
    Relation,
)
from reward_model.graph.frame import FrameGraph
from reward_model.graph.frame_kernels import Entities, packed_frame
from reward_model.graph.packing import FrameArrays, packed_signs, views, with_signs
from reward_model.scenes.scene import ScenarioError, SceneSequence, Snapshot

_WALL_SEGMENT: Final = 0.97  # m, no segment is longer
_MOST_SEGMENTS: Final = 100_000  # of a scene, 97 km of wall; every one is a node in each frame
_TIME_TOLERANCE: Final = 1e-6  # s, so that five steps of 0.2 s make a second in floating point

_WALL_SIGNS = np.ones(NUM_NODE_FEATURES, dtype=np.float32)
_WALL_SIGNS[WALL_DIRECTION] = -1
_TURNED: Final = packed_signs(_WALL_SIGNS)
_MIRRORED, _MIRRORED_TURNED = packed_signs(MIRROR_SIGNS), packed_signs(MIRROR_SIGNS * _WALL_SIGNS)


@dataclass(frozen=True, eq=False)
class SceneGraph:
    """A window of frames as one graph, every edge written out.

    Attributes:
        features: (num_nodes, 42), the newest frame's room node first
        sources, targets: (num_edges,) node indices
        relations: (num_edges,) of `Relation`
        lengths: (num_edges,) as in the network's input; 0 on self and temporal edges
    """

    features: Float32Array
    sources: Int32Array
    targets: Int32Array
    relations: Int32Array
    lengths: Float32Array

    @property
    def edge_features(self) -> Float32Array:
        """Edge features (num_edges, 18): the relation's one-hot, its last place overwritten with the length."""
        features = np.zeros((len(self.relations), NUM_EDGE_FEATURES), dtype=np.float32)
        features[np.arange(len(self.relations)), self.relations] = 1
        features[:, LENGTH_FEATURE] = self.lengths
        return features


def wall_segments(walls: FloatArray) -> IntArray:
    """The number of equal segments of each wall; a window uses that of its newest snapshot for all its frames.

    Args:
        walls: (num_walls, 4) [m]

    Returns:
        (num_walls,).

    Raises:
        ScenarioError: For more than 100,000 segments in all, whose graph would not fit into memory.
    """
    with np.errstate(over="ignore"):  # lengths beyond the largest number are too long as well
        lengths = np.hypot(walls[:, 2] - walls[:, 0], walls[:, 3] - walls[:, 1])
        counts = np.floor(lengths / _WALL_SEGMENT) + 1
        total = counts.sum()
    if total > _MOST_SEGMENTS:
        raise ScenarioError(
            f"a scene's walls must have at most {_MOST_SEGMENTS:,} segments of {_WALL_SEGMENT} m in all, "
            f"got {total:.3g}; are its lengths in metres?"
        )
    return counts.astype(np.int64)


def select_window(timestamps: Sequence[float], num_frames: int = NUM_FRAMES) -> list[int]:
    """The indices of the window's snapshots, newest first.

    The newest snapshot, then up to `num_frames` in all, each the newest that is at least a second older.

    Args:
        timestamps: [s], oldest first, not empty.
    """
    chosen = [len(timestamps) - 1]
    for index in range(len(timestamps) - 2, -1, -1):
        if len(chosen) == num_frames:
            break
        if timestamps[chosen[-1]] - timestamps[index] >= FRAME_SPACING - _TIME_TOLERANCE:
            chosen.append(index)
    return chosen


def frame_graph(snapshot: Snapshot, segments: IntArray) -> FrameGraph:
    """The nodes and edges of one snapshot.

    Args:
        segments: (num_walls,) from `wall_segments`, of the newest snapshot of the scene.

    Raises:
        ScenarioError: If two objects interact, for which the graph has no relation, or where the number of walls is not
            that of `segments`.
    """
    if len(segments) != len(snapshot.walls):
        raise ScenarioError(
            f"a scene's walls must not change: {len(segments)} walls in its newest snapshot, "
            f"{len(snapshot.walls)} in an older one"
        )
    people, objects = snapshot.people, snapshot.objects
    words = packed_frame(
        Entities(_whole(people.ids), _real(people.poses), _real(people.velocities)),
        Entities(_whole(objects.ids), _real(objects.poses), _real(objects.velocities)),
        _real(objects.sizes),
        _real(snapshot.command),
        _real(snapshot.goal),
        _real(snapshot.walls),
        segments,
        _whole(snapshot.interactions.pairs),
        float(snapshot.interval),
    )
    frame = FrameGraph.of_words(words)
    if snapshot.interactions.relations:
        check_links(frame)
    return frame


def check_links(frame: FrameGraph) -> None:
    """Raise `ScenarioError` where two objects interact, for which the graph has no relation."""
    if views(frame.words).link_relations.min(initial=0) < 0:
        raise ScenarioError("an interaction joins two objects; at least one of the two must be a person")


def sequence_frames(sequence: SceneSequence) -> list[FrameGraph]:
    """The frames of a sequence's window, newest first, from which its last second is scored."""
    chosen = select_window([snapshot.timestamp for snapshot in sequence])
    return all_frames(replace(sequence, snapshots=tuple(sequence.snapshots[index] for index in reversed(chosen))))


def all_frames(sequence: SceneSequence) -> list[FrameGraph]:
    """A frame for each snapshot of a sequence, newest first."""
    try:
        segments = wall_segments(sequence.last.walls)
        return [frame_graph(snapshot, segments) for snapshot in reversed(sequence.snapshots)]
    except ScenarioError as error:
        raise ScenarioError(f"{sequence.name}: {error}") from None


def scene_graph(frames: Sequence[FrameGraph]) -> SceneGraph:
    """Join up to three frames, newest first, into one graph with all its edges written out."""
    starts = np.cumsum([0, *(len(frame) for frame in frames)])
    arrays = [frame.arrays for frame in frames]
    features = np.concatenate([frame.features for frame in arrays])
    parts = []
    for time, frame in enumerate(arrays):
        features[starts[time] : starts[time + 1], TIME_FEATURES + time] = 1
        parts += [_shifted(edges, starts[time]) for edges in _frame_edges(frame)]
    for time in range(len(frames) - 1):
        newer, older = matching_nodes(arrays[time].keys, arrays[time + 1].keys)
        newer, older = newer + starts[time], older + starts[time + 1]
        parts.append(_plain_edges(newer, older, Relation.NOW_TO_SECOND + 2 * time))
        parts.append(_plain_edges(older, newer, Relation.SECOND_TO_NOW + 2 * time))
    sources, targets, relations, lengths = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    return SceneGraph(
        features,
        sources.astype(np.int32),
        targets.astype(np.int32),
        relations.astype(np.int32),
        lengths.astype(np.float32),
    )


def mirrored_frame(frame: FrameGraph, *, turn_walls: bool = False) -> FrameGraph:
    """The frame of the scene with left and right swapped; the same as mirroring the snapshot first.

    Args:
        turn_walls: also reverse the walls' direction. Recorded walls run clockwise, those of a mirror image run
            anticlockwise unless they are reversed; the network's input differs.
    """
    return FrameGraph.of_words(with_signs(frame.words, _MIRRORED_TURNED if turn_walls else _MIRRORED))


def reversed_walls(frame: FrameGraph) -> FrameGraph:
    """The frame of the scene with every wall listed from its other end."""
    return FrameGraph.of_words(with_signs(frame.words, _TURNED))


def matching_nodes(first: IntArray, second: IntArray) -> tuple[IntArray, IntArray]:
    """The indices at which two frames' keys are equal, pair by pair."""
    if np.array_equal(first, second):
        indices = np.arange(len(first))
        return indices, indices
    _, in_first, in_second = np.intersect1d(first, second, assume_unique=True, return_indices=True)
    return in_first, in_second


_Edges = tuple[NDArray[np.generic], NDArray[np.generic], NDArray[np.generic], NDArray[np.generic]]


def _frame_edges(frame: FrameArrays) -> list[_Edges]:
    nodes = np.arange(len(frame.kinds))
    others, room = nodes[1:], np.zeros(len(nodes) - 1, dtype=np.int64)
    kinds, lengths = frame.kinds[1:], frame.lengths[1:]
    return [
        (others, room, TO_ROOM[kinds], lengths),
        (room, others, FROM_ROOM[kinds], lengths),
        (frame.link_sources, frame.link_targets, frame.link_relations, frame.link_lengths),
        _plain_edges(nodes, nodes, Relation.SELF),
    ]


def _plain_edges(sources: IntArray, targets: IntArray, relation: int) -> _Edges:
    return sources, targets, np.full(len(sources), relation), np.zeros(len(sources))


def _shifted(edges: _Edges, start: int) -> _Edges:
    sources, targets, relations, lengths = edges
    return sources + start, targets + start, relations, lengths


# numba compiles anew for every memory layout, which takes seconds: arguments have one layout only.
def _real(values: FloatArray) -> FloatArray:
    return np.ascontiguousarray(values, dtype=np.float64)


def _whole(values: IntArray) -> IntArray:
    return np.ascontiguousarray(values, dtype=np.int64)
