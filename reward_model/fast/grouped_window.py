"""Windows of frames as flat arrays for compiled code: nodes sorted by kind, edges in groups.

Nodes are sorted by their frame's place in its window, then by kind, then by window. So the rows that are multiplied
with one matrix are consecutive, and the nodes that later layers leave out are at the end. Edges that have a length
are in groups of one relation and one centre: the receiver of a many-to-one group, the sender of a one-to-many group.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from reward_model.base.arrays import Float32Array, IntArray
from reward_model.base.numba import njit
from reward_model.graph.features import COLUMNS, FROM_ROOM, NUM_FRAMES, TO_ROOM, NodeKind, Relation
from reward_model.graph.packing import NUM_PACKED, Stack, num_words, offsets

KINDS: Final = (NodeKind.ROOM, NodeKind.PERSON, NodeKind.OBJECT, NodeKind.WALL, NodeKind.GOAL)
NUM_KINDS: Final = len(KINDS)
# For each of KINDS the features that are not 0 on its nodes: the kind, the place in the window, the kind's own.
FEATURES: Final = tuple(COLUMNS[kind] for kind in KINDS)

# Relations whose edges are grouped by their receiver, and those whose edges are grouped by their sender.
MANY_TO_ONE: Final = (*(Relation(TO_ROOM[kind]) for kind in KINDS[1:]), Relation.WALL_PERSON)
ONE_TO_MANY: Final = (
    *(Relation(FROM_ROOM[kind]) for kind in KINDS[1:]),
    Relation.OBJECT_PERSON,
    Relation.PERSON_OBJECT,
    Relation.PERSON_PERSON,
    Relation.PERSON_WALL,
)
GROUPED: Final = (*MANY_TO_ONE, *ONE_TO_MANY)
NUM_MANY_TO_ONE: Final = len(MANY_TO_ONE)
NUM_GROUPED: Final = len(GROUPED)
NUM_INTO_ROOM: Final = NUM_KINDS - 1  # the first of MANY_TO_ONE

_PLACE_OF_KIND: Final = np.array([KINDS.index(kind) for kind in NodeKind])
_PLACE_OF_RELATION: Final = np.array([GROUPED.index(each) if each in GROUPED else -1 for each in Relation])


class Nodes(NamedTuple):
    """The nodes of several windows.

    Attributes:
        features: (num_nodes, 16) those in `FEATURES` of the node's kind, padded with zeros
        starts: (3 * 5 * num_windows + 1,) the first node of each place in the window, kind (as in KINDS) and window
        newer, older: (num_nodes,) the same entity's node in the next newer and the next older frame, -1 where there is
            none
        inverse_degrees: (num_nodes,) one over the number of edges into each node, its self edge included
    """

    features: Float32Array
    starts: IntArray
    newer: IntArray
    older: IntArray
    inverse_degrees: Float32Array


class Edges(NamedTuple):
    """The edges that have a length, in groups of one relation and one centre.

    Attributes:
        others: (num_edges,) the node at the other end
        lengths: (num_edges,) of the edges
        centres: (num_groups,)
        starts: (num_groups + 1,) the first edge of each group
        bounds: (13, 4) the first group of each relation in `GROUPED` at each place in the window, and their end
    """

    others: IntArray
    lengths: Float32Array
    centres: IntArray
    starts: IntArray
    bounds: IntArray


@njit
def flat_windows(stack: Stack) -> tuple[Nodes, Edges]:
    """Sort the nodes and group the edges of windows."""
    frames = _frame_places(stack)
    starts, places = _node_places(stack, frames)
    newer, older = _neighbours(stack, frames, places)
    features, lengths = _features(stack, frames, places)
    edges = _edges(stack, frames, starts, places, lengths)
    return Nodes(features, starts, newer, older, _inverse_degrees(newer, older, edges)), edges


@njit
def _frame_places(stack: Stack) -> IntArray:
    """First word and first node of each frame, by place and window, (3, num_windows, 2); -1 where there is none."""
    places = np.full((NUM_FRAMES, len(stack.sizes), 2), -1, dtype=np.int64)
    start, node = 0, 0
    for window in range(len(stack.sizes)):
        for time in range(stack.sizes[window]):
            places[time, window, 0], places[time, window, 1] = start, node
            start, node = start + num_words(stack.words, start), node + stack.words[start]
    return places


@njit
def _node_places(stack: Stack, frames: IntArray) -> tuple[IntArray, IntArray]:
    """The first node of each section, and the sorted place of each of the stack's nodes."""
    num_windows = len(stack.sizes)
    starts = np.zeros(NUM_FRAMES * NUM_KINDS * num_windows + 1, dtype=np.int64)
    num_nodes = 0
    for window in range(num_windows):
        for time in range(stack.sizes[window]):
            start = frames[time, window, 0]
            kinds, count = offsets(stack.words, start).kinds, stack.words[start]
            for node in range(count):
                kind = _PLACE_OF_KIND[stack.words[kinds + node]]
                starts[(time * NUM_KINDS + kind) * num_windows + window + 1] += 1
            num_nodes += count
    for section in range(1, len(starts)):
        starts[section] += starts[section - 1]
    places, next_place = np.empty(num_nodes, dtype=np.int64), starts.copy()
    for window in range(num_windows):
        for time in range(stack.sizes[window]):
            start, first = frames[time, window]
            kinds = offsets(stack.words, start).kinds
            for node in range(stack.words[start]):
                section = (time * NUM_KINDS + _PLACE_OF_KIND[stack.words[kinds + node]]) * num_windows + window
                places[first + node] = next_place[section]
                next_place[section] += 1
    return starts, places


@njit
def _features(stack: Stack, frames: IntArray, places: IntArray) -> tuple[Float32Array, Float32Array]:
    """Features and the lengths of room edges, by sorted place."""
    features, lengths = np.empty((len(places), NUM_PACKED), np.float32), np.empty(len(places), np.float32)
    numbers = stack.words.view(np.float32)
    for window in range(len(stack.sizes)):
        for time in range(stack.sizes[window]):
            start, first = frames[time, window]
            at = offsets(stack.words, start)
            for node in range(stack.words[start]):
                place, row = places[first + node], at.features + node * NUM_PACKED
                lengths[place] = numbers[at.lengths + node]
                for column in range(NUM_PACKED):
                    features[place, column] = numbers[row + column]
                features[place, 1 + time] = 1
    return features, lengths


@njit
def _neighbours(stack: Stack, frames: IntArray, places: IntArray) -> tuple[IntArray, IntArray]:
    newer, older = np.full(len(places), -1, dtype=np.int64), np.full(len(places), -1, dtype=np.int64)
    keys = stack.words.view(np.int64)  # frames have an even number of words
    for window in range(len(stack.sizes)):
        for time in range(stack.sizes[window] - 1):
            first, second = frames[time, window], frames[time + 1, window]
            first_keys = offsets(stack.words, first[0]).keys // 2
            second_keys = offsets(stack.words, second[0]).keys // 2
            _match(
                keys[first_keys : first_keys + stack.words[first[0]]],
                keys[second_keys : second_keys + stack.words[second[0]]],
                places[first[1] :],
                places[second[1] :],
                newer,
                older,
            )
    return newer, older


@njit
def _match(
    first: IntArray,
    second: IntArray,
    first_places: IntArray,
    second_places: IntArray,
    newer: IntArray,
    older: IntArray,
) -> None:
    """Find each key of a frame among those of the next older one, most often right after the one found before."""
    following = 0
    for index in range(len(first)):
        other = following
        if other >= len(second) or second[other] != first[index]:
            other = 0
            while other < len(second) and second[other] != first[index]:
                other += 1
        if other < len(second):
            older[first_places[index]] = second_places[other]
            newer[second_places[other]] = first_places[index]
            following = other + 1


@njit
def _edges(stack: Stack, frames: IntArray, starts: IntArray, places: IntArray, lengths: Float32Array) -> Edges:
    """All edges with a length: every node's edges to and from its room, and the stack's links."""
    count = 2 * len(places) + len(stack.words) // 4  # at most: a link takes four words
    edges = Edges(
        np.empty(count, dtype=np.int64),
        np.empty(count, dtype=np.float32),
        np.empty(count, dtype=np.int64),
        np.empty(count + 1, dtype=np.int64),
        np.empty((NUM_GROUPED, NUM_FRAMES + 1), dtype=np.int64),
    )
    num_windows = len(stack.sizes)
    group, edge = 0, 0
    for relation in range(NUM_GROUPED):
        kind = 1 + (relation if relation < NUM_MANY_TO_ONE else relation - NUM_MANY_TO_ONE)
        of_room = kind < NUM_KINDS
        for time in range(NUM_FRAMES):
            edges.bounds[relation, time] = group
            for window in range(num_windows):
                start, node = frames[time, window]
                if start < 0:
                    continue
                if of_room:
                    room = time * NUM_KINDS * num_windows + window
                    group, edge = _add_room_edges(edges, group, edge, starts, lengths, room, kind * num_windows)
                else:
                    group, edge = _add_links(edges, group, edge, stack, start, places, node, relation)
        edges.bounds[relation, NUM_FRAMES] = group
    edges.starts[group] = edge
    starts_of_groups = edges.starts[: group + 1]
    return Edges(edges.others[:edge], edges.lengths[:edge], edges.centres[:group], starts_of_groups, edges.bounds)


@njit
def _add_room_edges(
    edges: Edges, group: int, edge: int, starts: IntArray, lengths: Float32Array, room: int, ahead: int
) -> tuple[int, int]:
    """Add the group of all nodes of one kind; `ahead`: sections from the room's to theirs."""
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
    edges: Edges, group: int, edge: int, stack: Stack, start: int, places: IntArray, first: int, relation: int
) -> tuple[int, int]:
    """Add a frame's links of one relation, a new group where the centre changes; `first`: the frame's first node."""
    words, at, last_centre = stack.words, offsets(stack.words, start), -1
    for link in range(words[start + 1]):
        if _PLACE_OF_RELATION[words[at.link_relations + link]] != relation:
            continue
        source, target = places[first + words[at.link_sources + link]], places[first + words[at.link_targets + link]]
        centre, other = (target, source) if relation < NUM_MANY_TO_ONE else (source, target)
        if centre != last_centre:
            edges.centres[group], edges.starts[group] = centre, edge
            group, last_centre = group + 1, centre
        edges.others[edge], edges.lengths[edge] = other, words.view(np.float32)[at.link_lengths + link]
        edge += 1
    return group, edge


@njit
def _inverse_degrees(newer: IntArray, older: IntArray, edges: Edges) -> Float32Array:
    degrees = np.ones(len(newer), dtype=np.float32)  # the self edge
    for node in range(len(degrees)):
        degrees[node] += (newer[node] >= 0) + (older[node] >= 0)
    first_one_to_many = edges.bounds[NUM_MANY_TO_ONE, 0]
    for group in range(len(edges.centres)):
        if group < first_one_to_many:
            degrees[edges.centres[group]] += edges.starts[group + 1] - edges.starts[group]
        else:
            for edge in range(edges.starts[group], edges.starts[group + 1]):
                degrees[edges.others[edge]] += 1
    inverse: Float32Array = np.reciprocal(degrees)
    return inverse
