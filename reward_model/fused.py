"""One window at a time through the factorised MPNN, as one compiled function: what an environment step waits for.

The arithmetic is that of `reward_model.compiled` without padding and without a framework between the products;
for a single window the framework is most of the cost. Products go to BLAS, the rest are loops over nodes and links.
"""

from __future__ import annotations

from collections.abc import Sequence as Items
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from reward_model.graph import (
    FROM_ROOM,
    NUM_FRAMES,
    TIME_FEATURES,
    TO_ROOM,
    Float32Array,
    FrameGraph,
    Int32Array,
    NodeKind,
    Relation,
    matching_nodes,
)
from reward_model.jit import njit
from reward_model.models.edge_networks import MEASURED, PLAIN, LayerOperators

_ROOM_KINDS: Final = (NodeKind.PERSON, NodeKind.OBJECT, NodeKind.WALL, NodeKind.GOAL)
_INTO_ROOM: Final = tuple(MEASURED.index(Relation(TO_ROOM[kind])) for kind in _ROOM_KINDS)
_OUT_OF_ROOM: Final = tuple(MEASURED.index(Relation(FROM_ROOM[kind])) for kind in _ROOM_KINDS)
_NUM_ROOM_KINDS: Final = len(_ROOM_KINDS)
# by NodeKind: the place in the tuples above, -1 for the room
_ROOM_COLUMN: Final = tuple(_ROOM_KINDS.index(kind) if kind in _ROOM_KINDS else -1 for kind in NodeKind)
_SELF: Final = PLAIN.index(Relation.SELF)
_TO_OLDER: Final = (PLAIN.index(Relation.NOW_TO_SECOND), PLAIN.index(Relation.SECOND_TO_THIRD))
_TO_NEWER: Final = (PLAIN.index(Relation.SECOND_TO_NOW), PLAIN.index(Relation.THIRD_TO_SECOND))
# by Relation: its place among the measured ones, -1 for the others
_MEASURED_PLACE: Final = tuple(MEASURED.index(r) if r in MEASURED else -1 for r in Relation)
_WALL_PERSON: Final = int(Relation.WALL_PERSON)


class _Window(NamedTuple):
    """A window as flat arrays, frame after frame, newest first.

    starts: (num_frames + 1,) the first node of each frame
    pairs: (num_pairs, 2) the same thing's nodes in a frame and in the next older one
    pair_starts: (num_frames,) the first pair of each two frames
    """

    features: Float32Array
    kinds: Int32Array
    lengths: Float32Array
    starts: NDArray[np.int64]
    sources: NDArray[np.int64]
    targets: NDArray[np.int64]
    relations: Int32Array
    link_lengths: Float32Array
    pairs: NDArray[np.int64]
    pair_starts: NDArray[np.int64]


class _Layer(NamedTuple):
    """One layer's arrays, laid out for the products below.

    plain: (5, in, out); into_room: (4 * rank * in, out); out_of_room: (in, 4 * rank * out)
    aggregate: (13, rank * in, out); project: (13, in, rank * out)
    coefficients: (13, num_lengths, rank); steps: (13,); bias: (out,)
    """

    plain: Float32Array
    into_room: Float32Array
    out_of_room: Float32Array
    aggregate: Float32Array
    project: Float32Array
    coefficients: Float32Array
    steps: Float32Array
    bias: Float32Array


class FusedMPNN:
    """A network turned into operators, ready to score windows on the CPU."""

    def __init__(self, operators: Items[LayerOperators]) -> None:
        self._layers = tuple(_layer_arrays(layer) for layer in operators)

    def __call__(self, window: Items[FrameGraph]) -> Float32Array:
        """(2,) the scores of one window of up to three frames, newest first."""
        return _forward(_flatten(window), self._layers)


def _layer_arrays(layer: LayerOperators) -> _Layer:
    plain, basis, coefficients, steps, bias = (
        np.ascontiguousarray(tensor.detach().numpy(), dtype=np.float32)
        for tensor in (layer.plain, layer.basis, layer.coefficients, layer.steps, layer.bias)
    )
    num_measured, rank, inputs, outputs = basis.shape
    by_input = np.ascontiguousarray(basis.transpose(0, 2, 1, 3))  # (13, in, rank, out)
    into_room = basis[list(_INTO_ROOM)].reshape(-1, outputs)
    out_of_room = np.ascontiguousarray(by_input[list(_OUT_OF_ROOM)].transpose(1, 0, 2, 3)).reshape(inputs, -1)
    aggregate = basis.reshape(num_measured, rank * inputs, outputs)
    project = by_input.reshape(num_measured, inputs, rank * outputs)
    return _Layer(plain, into_room, out_of_room, aggregate, project, coefficients, steps, bias)


def _flatten(window: Items[FrameGraph]) -> _Window:
    starts = np.cumsum([0, *(len(frame) for frame in window)])
    features = np.concatenate([frame.features for frame in window])
    for time in range(len(window)):
        features[starts[time] : starts[time + 1], TIME_FEATURES + time] = 1
    pairs, pair_starts = [np.zeros((0, 2), dtype=np.int64)], [0]
    for time in range(len(window) - 1):
        newer, older = matching_nodes(window[time].keys, window[time + 1].keys)
        pairs.append(np.stack([newer + starts[time], older + starts[time + 1]], axis=1))
        pair_starts.append(pair_starts[-1] + len(newer))
    return _Window(
        features,
        np.concatenate([frame.kinds for frame in window]),
        np.concatenate([frame.lengths for frame in window]),
        starts,
        np.concatenate([frame.link_sources + start for frame, start in zip(window, starts, strict=False)]),
        np.concatenate([frame.link_targets + start for frame, start in zip(window, starts, strict=False)]),
        np.concatenate([frame.link_relations for frame in window]),
        np.concatenate([frame.link_lengths for frame in window]),
        np.concatenate(pairs),
        np.array(pair_starts),
    )


@njit
def _forward(window: _Window, layers: tuple[_Layer, ...]) -> Float32Array:
    hidden, degrees = window.features, _degrees(window)
    num_frames = len(window.starts) - 1
    for index in range(len(layers)):
        # Only frames from which the newest room can still be reached in the layers left.
        frames = min(num_frames, len(layers) - index)
        hidden = _all_nodes(window, layers[index], hidden, frames, degrees)
        if index < len(layers) - 1:
            for node in range(hidden.shape[0]):
                for column in range(hidden.shape[1]):
                    if hidden[node, column] < 0:
                        hidden[node, column] = np.expm1(hidden[node, column])
    return np.maximum(hidden[0], np.float32(0))


@njit
def _degrees(window: _Window) -> Float32Array:
    degrees = np.full(len(window.kinds), 2, dtype=np.float32)  # the room's edge and its own
    for frame in range(len(window.starts) - 1):
        degrees[window.starts[frame]] = window.starts[frame + 1] - window.starts[frame]
    for target in window.targets:
        degrees[target] += 1
    for pair in range(len(window.pairs)):
        degrees[window.pairs[pair, 0]] += 1
        degrees[window.pairs[pair, 1]] += 1
    return degrees


@njit
def _all_nodes(
    window: _Window, layer: _Layer, hidden: Float32Array, frames: int, degrees: Float32Array
) -> Float32Array:
    """One layer for the nodes of the newest frames."""
    count = window.starts[frames]
    out = np.dot(hidden[:count], layer.plain[_SELF])
    _add_temporal(window, layer, hidden, out, frames)
    _add_room(window, layer, hidden, out, frames)
    _add_links(window, layer, hidden, out)
    for node in range(count):
        share = np.float32(1) / degrees[node]
        for column in range(out.shape[1]):
            out[node, column] = out[node, column] * share + layer.bias[column]
    return out


@njit
def _add_temporal(window: _Window, layer: _Layer, hidden: Float32Array, out: Float32Array, frames: int) -> None:
    starts = window.starts
    for gap in range(len(window.pair_starts) - 1):
        first, last = window.pair_starts[gap], window.pair_starts[gap + 1]
        if gap + 1 < frames:
            said = np.dot(hidden[starts[gap] : starts[gap + 1]], layer.plain[_TO_OLDER[gap]])
            for pair in range(first, last):
                out[window.pairs[pair, 1]] += said[window.pairs[pair, 0] - starts[gap]]
        if gap < frames:
            said = np.dot(hidden[starts[gap + 1] : starts[gap + 2]], layer.plain[_TO_NEWER[gap]])
            for pair in range(first, last):
                out[window.pairs[pair, 0]] += said[window.pairs[pair, 1] - starts[gap + 1]]


@njit
def _add_room(window: _Window, layer: _Layer, hidden: Float32Array, out: Float32Array, frames: int) -> None:
    """Everything to the room: summed before one product; the room to everything: one product, then shared out."""
    rank, inputs, outputs = layer.coefficients.shape[2], hidden.shape[1], out.shape[1]
    heard = np.zeros((frames, _NUM_ROOM_KINDS * rank, inputs), dtype=np.float32)
    rooms = np.empty((frames, inputs), dtype=np.float32)
    for frame in range(frames):
        rooms[frame] = hidden[window.starts[frame]]
    said = np.dot(rooms, layer.out_of_room).reshape(frames, _NUM_ROOM_KINDS * rank, outputs)
    weights = np.empty(rank, dtype=np.float32)
    for frame in range(frames):
        for node in range(window.starts[frame] + 1, window.starts[frame + 1]):
            column = _ROOM_COLUMN[window.kinds[node]]
            _read(layer, _INTO_ROOM[column], window.lengths[node], weights)
            for k in range(rank):
                if weights[k] != 0:
                    row = heard[frame, column * rank + k]
                    for i in range(inputs):
                        row[i] += weights[k] * hidden[node, i]
            _read(layer, _OUT_OF_ROOM[column], window.lengths[node], weights)
            for k in range(rank):
                if weights[k] != 0:
                    row = said[frame, column * rank + k]
                    for j in range(outputs):
                        out[node, j] += weights[k] * row[j]
    messages = np.dot(heard.reshape(frames, -1), layer.into_room)
    for frame in range(frames):
        out[window.starts[frame]] += messages[frame]


@njit
def _add_links(window: _Window, layer: _Layer, hidden: Float32Array, out: Float32Array) -> None:
    """Interactions and people near walls. Persons are the few: products are made once for each of them."""
    rank, inputs, outputs, count = layer.coefficients.shape[2], hidden.shape[1], out.shape[1], len(out)
    weights = np.empty(rank, dtype=np.float32)
    heard = np.empty((rank, inputs), dtype=np.float32)
    said = np.empty((rank, outputs), dtype=np.float32)
    done = np.zeros(len(window.sources), dtype=np.bool_)
    for link in range(len(window.sources)):
        if done[link] or window.targets[link] >= count:
            continue
        relation, source, target = window.relations[link], window.sources[link], window.targets[link]
        place = _MEASURED_PLACE[relation]
        if relation == _WALL_PERSON:
            heard[:] = 0
            for other in range(link, len(window.sources)):
                if window.relations[other] == relation and window.targets[other] == target:
                    done[other] = True
                    _read(layer, place, window.link_lengths[other], weights)
                    for k in range(rank):
                        if weights[k] != 0:
                            for i in range(inputs):
                                heard[k, i] += weights[k] * hidden[window.sources[other], i]
            out[target] += np.dot(heard.reshape(-1), layer.aggregate[place])
        else:
            said[:] = np.dot(hidden[source], layer.project[place]).reshape(rank, outputs)
            for other in range(link, len(window.sources)):
                if window.relations[other] == relation and window.sources[other] == source:
                    done[other] = True
                    _read(layer, place, window.link_lengths[other], weights)
                    for k in range(rank):
                        if weights[k] != 0:
                            for j in range(outputs):
                                out[window.targets[other], j] += weights[k] * said[k, j]


@njit
def _read(layer: _Layer, place: int, length: float, weights: Float32Array) -> None:
    """The coefficients of a relation at a length, linear between and beyond the sampled lengths."""
    position = length / layer.steps[place]
    table = layer.coefficients[place]
    row = min(int(position), len(table) - 2)
    share = np.float32(position - row)
    for k in range(len(weights)):
        weights[k] = table[row, k] * (np.float32(1) - share) + table[row + 1, k] * share


assert len(PLAIN) == 2 * NUM_FRAMES - 1
