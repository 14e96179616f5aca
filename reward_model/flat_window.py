"""One window of frames as flat arrays, as the fused network walks through them: nodes, and links in groups."""

from __future__ import annotations

from collections.abc import Sequence as Items
from typing import Final, NamedTuple

import numpy as np

from reward_model.graph import (
    NUM_FRAMES,
    TIME_FEATURES,
    Float32Array,
    FrameGraph,
    Int32Array,
    Relation,
)
from reward_model.jit import njit
from reward_model.scenario import IntArray

_NUM_RELATIONS: Final = len(Relation)
_WALL_PERSON: Final = int(Relation.WALL_PERSON)


class _Frame(NamedTuple):
    """What the network reads of a `FrameGraph`, under its names."""

    features: Float32Array
    kinds: Int32Array
    keys: IntArray
    lengths: Float32Array
    link_sources: Int32Array
    link_targets: Int32Array
    link_relations: Int32Array
    link_lengths: Float32Array


class Nodes(NamedTuple):
    """The nodes of a window as flat arrays, frame after frame, newest first.

    starts: (num_frames + 1,) the first node of each frame
    older: (num_nodes,) the same thing's node in the next older frame, -1 where there is none
    shares: (num_nodes,) one over the number of edges that each node hears
    """

    features: Float32Array
    kinds: Int32Array
    lengths: Float32Array
    starts: IntArray
    older: IntArray
    shares: Float32Array


class Links(NamedTuple):
    """The links of a window, sorted so that those with one relation and one centre stand together.

    A link's centre is its end that is a person where the other is a wall segment, else its source.
    starts: (num_groups + 1,) the first link of each group
    """

    sources: IntArray
    targets: IntArray
    relations: IntArray
    lengths: Float32Array
    starts: IntArray


Frames = tuple[_Frame, ...]


def flat_window(window: Items[FrameGraph]) -> tuple[Nodes, Links]:
    """Join up to three frames, newest first."""
    return join_frames(padded_frames(window), len(window))


def padded_frames(window: Items[FrameGraph]) -> Frames:
    """The arrays of three frames, the newest one again for those that are missing: one compiled form serves all."""
    frames = [_frame(graph) for graph in window]
    return (*frames, *[frames[0]] * (NUM_FRAMES - len(frames)))


def _frame(graph: FrameGraph) -> _Frame:
    return _Frame(
        graph.features,
        graph.kinds,
        graph.keys,
        graph.lengths,
        graph.link_sources,
        graph.link_targets,
        graph.link_relations,
        graph.link_lengths,
    )


@njit
def join_frames(frames: Frames, num_frames: int) -> tuple[Nodes, Links]:
    """Join the first frames of a padded window."""
    starts = np.zeros(num_frames + 1, dtype=np.int64)
    for time in range(num_frames):
        starts[time + 1] = starts[time] + len(frames[time].kinds)
    links = _join_links(frames, starts)
    return _join_nodes(frames, starts, links.targets), links


@njit
def _join_nodes(frames: Frames, starts: IntArray, link_targets: IntArray) -> Nodes:
    num_frames, count = len(starts) - 1, starts[-1]
    features = np.empty((count, frames[0].features.shape[1]), dtype=np.float32)
    kinds, lengths = np.empty(count, dtype=np.int32), np.empty(count, dtype=np.float32)
    older = np.full(count, -1, dtype=np.int64)
    for time in range(num_frames):
        first, last = starts[time], starts[time + 1]
        features[first:last] = frames[time].features
        features[first:last, TIME_FEATURES + time] = 1
        kinds[first:last] = frames[time].kinds
        lengths[first:last] = frames[time].lengths
        if time + 1 < num_frames:
            _match(frames[time].keys, frames[time + 1].keys, last, older[first:last])
    return Nodes(features, kinds, lengths, starts, older, _shares(starts, older, link_targets))


@njit
def _match(newer: IntArray, older: IntArray, start: int, nodes: IntArray) -> None:
    """Find each newer key among the older ones, most often at the same place; `start` is the older frame's."""
    for index in range(len(newer)):
        if index < len(older) and older[index] == newer[index]:
            nodes[index] = start + index
            continue
        for other in range(len(older)):
            if older[other] == newer[index]:
                nodes[index] = start + other


@njit
def _join_links(frames: Frames, node_starts: IntArray) -> Links:
    count = 0
    for time in range(len(node_starts) - 1):
        count += len(frames[time].link_relations)
    sources, targets = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    relations, lengths = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.float32)
    groups = np.empty(count, dtype=np.int64)
    place = 0
    for time in range(len(node_starts) - 1):
        frame = frames[time]
        for link in range(len(frame.link_relations)):
            sources[place] = frame.link_sources[link] + node_starts[time]
            targets[place] = frame.link_targets[link] + node_starts[time]
            relations[place] = frame.link_relations[link]
            lengths[place] = frame.link_lengths[link]
            centre = targets[place] if relations[place] == _WALL_PERSON else sources[place]
            groups[place] = centre * _NUM_RELATIONS + relations[place]
            place += 1
    order = np.argsort(groups, kind="mergesort")
    starts = np.empty(count + 1, dtype=np.int64)
    num_groups = 0
    for link in range(count):
        if link == 0 or groups[order[link]] != groups[order[link - 1]]:
            starts[num_groups] = link
            num_groups += 1
    starts[num_groups] = count
    return Links(sources[order], targets[order], relations[order], lengths[order], starts[: num_groups + 1])


@njit
def _shares(starts: IntArray, older: IntArray, link_targets: IntArray) -> Float32Array:
    degrees = np.full(starts[-1], 2, dtype=np.float32)  # the room's edge and its own
    for frame in range(len(starts) - 1):
        degrees[starts[frame]] = starts[frame + 1] - starts[frame]
    for target in link_targets:
        degrees[target] += 1
    for node in range(len(older)):
        if older[node] >= 0:
            degrees[node] += 1
            degrees[older[node]] += 1
    shares: Float32Array = np.reciprocal(degrees)
    return shares
