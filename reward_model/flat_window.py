"""Windows of frames as flat arrays, as the fused network walks through them: nodes, and edges in groups.

Nodes stand together by the frame's place in its window, then by kind, then by window. So what is multiplied with one
matrix are rows one after the other, and what later layers leave out stands at the end.
"""

from __future__ import annotations

from collections.abc import Sequence as Items
from typing import Final, NamedTuple

import numpy as np

from reward_model.graph import (
    FROM_ROOM,
    NUM_FRAMES,
    TIME_FEATURES,
    TO_ROOM,
    Float32Array,
    FrameGraph,
    NodeKind,
    Relation,
)
from reward_model.jit import njit
from reward_model.scenario import IntArray

KINDS: Final = (NodeKind.ROOM, NodeKind.PERSON, NodeKind.OBJECT, NodeKind.WALL, NodeKind.GOAL)
NUM_KINDS: Final = len(KINDS)
_TIMES: Final = tuple(range(TIME_FEATURES, TIME_FEATURES + NUM_FRAMES))
# For each of KINDS the features that are not 0 on its nodes: the kind, the place in the window, the kind's own.
FEATURES: Final = (
    (NodeKind.ROOM, *_TIMES, 17, 18, 30, 31),
    (NodeKind.PERSON, *_TIMES, *range(8, 17)),
    (NodeKind.OBJECT, *_TIMES, *range(19, 30)),
    (NodeKind.WALL, *_TIMES, *range(32, 38)),
    (NodeKind.GOAL, *_TIMES, *range(38, 42)),
)
NUM_FEATURES: Final = 16  # the most that a kind has, as a multiple of what processors handle at once

# Relations whose edges meet at their target, which hears a sum, and those whose edges part at their source.
MEETING: Final = (*(Relation(TO_ROOM[kind]) for kind in KINDS[1:]), Relation.WALL_PERSON)
PARTING: Final = (
    *(Relation(FROM_ROOM[kind]) for kind in KINDS[1:]),
    Relation.OBJECT_PERSON,
    Relation.PERSON_OBJECT,
    Relation.PERSON_PERSON,
    Relation.PERSON_WALL,
)
GROUPED: Final = (*MEETING, *PARTING)
NUM_MEETING: Final = len(MEETING)
NUM_GROUPED: Final = len(GROUPED)
NUM_INTO_ROOM: Final = NUM_KINDS - 1  # the first of MEETING

_NUM_FEATURES: Final = np.array([len(columns) for columns in FEATURES])
_FEATURE_TABLE: Final = np.array([(*columns, *[-1] * (NUM_FEATURES - len(columns))) for columns in FEATURES])
_PLACE_OF_KIND: Final = np.array([KINDS.index(kind) for kind in NodeKind])
_PLACE_OF_RELATION: Final = np.array([GROUPED.index(each) if each in GROUPED else -1 for each in Relation])


class Stack(NamedTuple):
    """The arrays of `FrameGraph`, of all frames of several windows one after the other.

    counts: (num_frames, 2) how many nodes and links each frame has
    sizes: (num_windows,) how many frames each window has
    """

    features: Float32Array
    kinds: IntArray
    keys: IntArray
    lengths: Float32Array
    link_sources: IntArray
    link_targets: IntArray
    link_relations: IntArray
    link_lengths: Float32Array
    counts: IntArray
    sizes: IntArray


class Nodes(NamedTuple):
    """The nodes of several windows.

    features: (num_nodes, 16) those in `FEATURES` of the node's kind, padded with zeros
    starts: (3 * 5 * num_windows + 1,) the first node of each place in the window, kind (as in KINDS) and window
    newer, older: (num_nodes,) the same thing's node in the next newer and the next older frame, -1 where there is none
    shares: (num_nodes,) one over the number of edges that each node hears
    """

    features: Float32Array
    starts: IntArray
    newer: IntArray
    older: IntArray
    shares: Float32Array


class Edges(NamedTuple):
    """The edges that have a length, in groups of one relation and one centre, the node where they meet or part.

    others: (num_edges,) the node at the other end
    lengths: (num_edges,) of the edges
    centres: (num_groups,)
    starts: (num_groups + 1,) the first edge of each group
    bounds: (13, 4) of each relation in `GROUPED`, the first group at each place in the window, and where they end
    """

    others: IntArray
    lengths: Float32Array
    centres: IntArray
    starts: IntArray
    bounds: IntArray


def stack_windows(windows: Items[Items[FrameGraph]]) -> Stack:
    """Join the frames of windows, newest first."""
    frames = [frame for window in windows for frame in window]
    return Stack(
        np.concatenate([frame.features for frame in frames]),
        np.concatenate([frame.kinds for frame in frames]),
        np.concatenate([frame.keys for frame in frames]),
        np.concatenate([frame.lengths for frame in frames]),
        np.concatenate([frame.link_sources for frame in frames]),
        np.concatenate([frame.link_targets for frame in frames]),
        np.concatenate([frame.link_relations for frame in frames]),
        np.concatenate([frame.link_lengths for frame in frames]),
        np.array([count for frame in frames for count in (len(frame.kinds), len(frame.link_lengths))]).reshape(-1, 2),
        np.array([len(window) for window in windows]),
    )


@njit
def flat_windows(stack: Stack) -> tuple[Nodes, Edges]:
    """Sort the nodes and put the edges into groups."""
    starts, places = _node_places(stack)
    edges = _edges(stack, starts, places)
    newer, older = _neighbours(stack, places)
    return Nodes(_features(stack, places), starts, newer, older, _shares(newer, older, edges)), edges


@njit
def _node_places(stack: Stack) -> tuple[IntArray, IntArray]:
    """Where each section starts, and where each of the stack's nodes goes."""
    num_windows = len(stack.sizes)
    starts = np.zeros(NUM_FRAMES * NUM_KINDS * num_windows + 1, dtype=np.int64)
    places = np.empty(len(stack.kinds), dtype=np.int64)
    frame, node = 0, 0
    for window in range(num_windows):
        for time in range(stack.sizes[window]):
            for _ in range(stack.counts[frame, 0]):
                kind = _PLACE_OF_KIND[stack.kinds[node]]
                places[node] = (time * NUM_KINDS + kind) * num_windows + window
                starts[places[node] + 1] += 1
                node += 1
            frame += 1
    for section in range(1, len(starts)):
        starts[section] += starts[section - 1]
    next_place = starts.copy()
    for node in range(len(places)):
        section = places[node]
        places[node] = next_place[section]
        next_place[section] += 1
    return starts, places


@njit
def _features(stack: Stack, places: IntArray) -> Float32Array:
    features = np.zeros((len(places), NUM_FEATURES), dtype=np.float32)
    frame, node = 0, 0
    for size in stack.sizes:
        for time in range(size):
            for _ in range(stack.counts[frame, 0]):
                kind, place = _PLACE_OF_KIND[stack.kinds[node]], places[node]
                for index in range(_NUM_FEATURES[kind]):
                    features[place, index] = stack.features[node, _FEATURE_TABLE[kind, index]]
                features[place, 1 + time] = 1
                node += 1
            frame += 1
    return features


@njit
def _neighbours(stack: Stack, places: IntArray) -> tuple[IntArray, IntArray]:
    newer, older = np.full(len(places), -1, dtype=np.int64), np.full(len(places), -1, dtype=np.int64)
    frame, start = 0, 0
    for size in stack.sizes:
        for time in range(size):
            middle = start + stack.counts[frame, 0]
            if time + 1 < size:
                end = middle + stack.counts[frame + 1, 0]
                _match(stack.keys[start:middle], stack.keys[middle:end], places[start:end], newer, older)
            frame, start = frame + 1, middle
    return newer, older


@njit
def _match(first: IntArray, second: IntArray, places: IntArray, newer: IntArray, older: IntArray) -> None:
    """Find each key of a frame among those of the next older one, most often at the same place."""
    for index in range(len(first)):
        other = index
        if index >= len(second) or second[index] != first[index]:
            other = 0
            while other < len(second) and second[other] != first[index]:
                other += 1
        if other < len(second):
            older[places[index]] = places[len(first) + other]
            newer[places[len(first) + other]] = places[index]


@njit
def _edges(stack: Stack, starts: IntArray, places: IntArray) -> Edges:
    """Every node has an edge to its room and one back; the others are the stack's links."""
    lengths = np.empty(len(places), dtype=np.float32)
    lengths[places] = stack.lengths
    count = 2 * len(places) + len(stack.link_lengths)  # at most
    edges = Edges(
        np.empty(count, dtype=np.int64),
        np.empty(count, dtype=np.float32),
        np.empty(count, dtype=np.int64),
        np.empty(count + 1, dtype=np.int64),
        np.empty((NUM_GROUPED, NUM_FRAMES + 1), dtype=np.int64),
    )
    firsts = _first_nodes_and_links(stack)
    group, edge = 0, 0
    for relation in range(NUM_GROUPED):
        kind = 1 + (relation if relation < NUM_MEETING else relation - NUM_MEETING)
        of_room = kind < NUM_KINDS
        for time in range(NUM_FRAMES):
            edges.bounds[relation, time] = group
            for window in range(firsts.shape[1]):
                if firsts[time, window, 0] < 0:
                    continue
                if of_room:
                    room = time * NUM_KINDS * firsts.shape[1] + window
                    group, edge = _add_room_edges(edges, group, edge, starts, lengths, room, kind * firsts.shape[1])
                else:
                    group, edge = _add_links(edges, group, edge, stack, places, firsts[time, window], relation)
        edges.bounds[relation, NUM_FRAMES] = group
    edges.starts[group] = edge
    starts_of_groups = edges.starts[: group + 1]
    return Edges(edges.others[:edge], edges.lengths[:edge], edges.centres[:group], starts_of_groups, edges.bounds)


@njit
def _first_nodes_and_links(stack: Stack) -> IntArray:
    """(3, num_windows, 3) by place and window: a frame's first node, first link and its last one's successor, or -1."""
    firsts = np.full((NUM_FRAMES, len(stack.sizes), 3), -1, dtype=np.int64)
    frame, node, link = 0, 0, 0
    for window in range(len(stack.sizes)):
        for time in range(stack.sizes[window]):
            firsts[time, window, 0], firsts[time, window, 1] = node, link
            node, link = node + stack.counts[frame, 0], link + stack.counts[frame, 1]
            firsts[time, window, 2] = link
            frame += 1
    return firsts


@njit
def _add_room_edges(
    edges: Edges, group: int, edge: int, starts: IntArray, lengths: Float32Array, room: int, ahead: int
) -> tuple[int, int]:
    """One group, of all nodes of one kind; `ahead`: sections from the room's to theirs."""
    first, last = starts[room + ahead], starts[room + ahead + 1]
    if first == last:
        return group, edge
    edges.centres[group], edges.starts[group] = starts[room], edge
    for node in range(first, last):
        edges.others[edge], edges.lengths[edge] = node, lengths[node]
        edge += 1
    return group + 1, edge


@njit
def _add_links(
    edges: Edges, group: int, edge: int, stack: Stack, places: IntArray, firsts: IntArray, relation: int
) -> tuple[int, int]:
    """A frame's links of one relation, a new group for each centre other than the last one's."""
    last_centre = -1
    for link in range(firsts[1], firsts[2]):
        if _PLACE_OF_RELATION[stack.link_relations[link]] != relation:
            continue
        source, target = places[firsts[0] + stack.link_sources[link]], places[firsts[0] + stack.link_targets[link]]
        centre, other = (target, source) if relation < NUM_MEETING else (source, target)
        if centre != last_centre:
            edges.centres[group], edges.starts[group] = centre, edge
            group, last_centre = group + 1, centre
        edges.others[edge], edges.lengths[edge] = other, stack.link_lengths[link]
        edge += 1
    return group, edge


@njit
def _shares(newer: IntArray, older: IntArray, edges: Edges) -> Float32Array:
    degrees = np.ones(len(newer), dtype=np.float32)  # its own
    for node in range(len(degrees)):
        degrees[node] += (newer[node] >= 0) + (older[node] >= 0)
    first_parting = edges.bounds[NUM_MEETING, 0]
    for group in range(len(edges.centres)):
        if group < first_parting:
            degrees[edges.centres[group]] += edges.starts[group + 1] - edges.starts[group]
        else:
            for edge in range(edges.starts[group], edges.starts[group + 1]):
                degrees[edges.others[edge]] += 1
    shares: Float32Array = np.reciprocal(degrees)
    return shares
