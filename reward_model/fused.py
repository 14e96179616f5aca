"""One window at a time through the factorised MPNN, as one compiled function: what an environment step waits for.

The arithmetic is that of `reward_model.compiled` without padding and without a framework between the products;
for a single window the framework is most of the cost. Products go to BLAS, the rest are loops over nodes and links.
"""

from __future__ import annotations

from collections.abc import Sequence as Items
from typing import Final, NamedTuple

import numpy as np

from reward_model.flat_window import Links, Nodes, flat_window
from reward_model.graph import (
    FROM_ROOM,
    NUM_FRAMES,
    TO_ROOM,
    Float32Array,
    FrameGraph,
    NodeKind,
    Relation,
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
        nodes, links = flat_window(window)
        return _forward(nodes, links, self._layers)


def _layer_arrays(layer: LayerOperators) -> _Layer:
    plain, basis, coefficients, steps, bias = (
        np.array(tensor.detach().cpu().numpy(), dtype=np.float32, order="C")  # a copy: training on changes nothing
        for tensor in (layer.plain, layer.basis, layer.coefficients, layer.steps, layer.bias)
    )
    num_measured, rank, inputs, outputs = basis.shape
    by_input = np.ascontiguousarray(basis.transpose(0, 2, 1, 3))  # (13, in, rank, out)
    into_room = basis[list(_INTO_ROOM)].reshape(-1, outputs)
    out_of_room = np.ascontiguousarray(by_input[list(_OUT_OF_ROOM)].transpose(1, 0, 2, 3)).reshape(inputs, -1)
    aggregate = basis.reshape(num_measured, rank * inputs, outputs)
    project = by_input.reshape(num_measured, inputs, rank * outputs)
    return _Layer(plain, into_room, out_of_room, aggregate, project, coefficients, steps, bias)


@njit
def _forward(nodes: Nodes, links: Links, layers: tuple[_Layer, ...]) -> Float32Array:
    hidden, num_frames = nodes.features, len(nodes.starts) - 1
    for index in range(len(layers)):
        # Only frames from which the newest room can still be reached in the layers left.
        reached = min(num_frames, len(layers) - index)
        hidden = _all_nodes(nodes, links, layers[index], hidden, reached)
        if index < len(layers) - 1:
            _apply_elu(hidden)
    scores: Float32Array = np.maximum(hidden[0], np.float32(0))
    return scores


@njit
def _apply_elu(hidden: Float32Array) -> None:
    for node in range(hidden.shape[0]):
        for column in range(hidden.shape[1]):
            if hidden[node, column] < 0:
                hidden[node, column] = np.expm1(hidden[node, column])


@njit
def _all_nodes(nodes: Nodes, links: Links, layer: _Layer, hidden: Float32Array, frames: int) -> Float32Array:
    """One layer for the nodes of the newest frames."""
    count = nodes.starts[frames]
    out: Float32Array = np.dot(hidden[:count], layer.plain[_SELF])
    _add_temporal(nodes, layer, hidden, out, frames)
    _add_to_room(nodes, layer, hidden, out, frames)
    _add_from_room(nodes, layer, hidden, out, frames)
    _add_links(links, layer, hidden, out)
    for node in range(count):
        for column in range(out.shape[1]):
            out[node, column] = out[node, column] * nodes.shares[node] + layer.bias[column]
    return out


@njit
def _add_temporal(nodes: Nodes, layer: _Layer, hidden: Float32Array, out: Float32Array, frames: int) -> None:
    starts = nodes.starts
    for gap in range(len(starts) - 2):
        newer, older, end = starts[gap], starts[gap + 1], starts[gap + 2]
        if gap + 1 < frames:
            said = np.dot(hidden[newer:older], layer.plain[_TO_OLDER[gap]])
            for node in range(newer, older):
                if nodes.older[node] >= 0:
                    out[nodes.older[node]] += said[node - newer]
        if gap < frames:
            said = np.dot(hidden[older:end], layer.plain[_TO_NEWER[gap]])
            for node in range(newer, older):
                if nodes.older[node] >= 0:
                    out[node] += said[nodes.older[node] - older]


@njit
def _add_to_room(nodes: Nodes, layer: _Layer, hidden: Float32Array, out: Float32Array, frames: int) -> None:
    """Everything to the room: summed before one product."""
    rank = layer.coefficients.shape[2]
    heard = np.zeros((frames, _NUM_ROOM_KINDS * rank, hidden.shape[1]), dtype=np.float32)
    weights = np.empty(rank, dtype=np.float32)
    for frame in range(frames):
        for node in range(nodes.starts[frame] + 1, nodes.starts[frame + 1]):
            column = _ROOM_COLUMN[nodes.kinds[node]]
            _read(layer, _INTO_ROOM[column], nodes.lengths[node], weights)
            _spread(weights, hidden[node], heard[frame, column * rank : (column + 1) * rank])
    messages = np.dot(heard.reshape(frames, -1), layer.into_room)
    for frame in range(frames):
        out[nodes.starts[frame]] += messages[frame]


@njit
def _add_from_room(nodes: Nodes, layer: _Layer, hidden: Float32Array, out: Float32Array, frames: int) -> None:
    """The room to everything: one product, then shared out."""
    rank = layer.coefficients.shape[2]
    rooms = np.empty((frames, hidden.shape[1]), dtype=np.float32)
    for frame in range(frames):
        rooms[frame] = hidden[nodes.starts[frame]]
    said = np.dot(rooms, layer.out_of_room).reshape(frames, _NUM_ROOM_KINDS * rank, out.shape[1])
    weights = np.empty(rank, dtype=np.float32)
    for frame in range(frames):
        for node in range(nodes.starts[frame] + 1, nodes.starts[frame + 1]):
            column = _ROOM_COLUMN[nodes.kinds[node]]
            _read(layer, _OUT_OF_ROOM[column], nodes.lengths[node], weights)
            _gather(weights, said[frame, column * rank : (column + 1) * rank], out[node])


@njit
def _add_links(links: Links, layer: _Layer, hidden: Float32Array, out: Float32Array) -> None:
    """Interactions and people near walls. Centres are few: products are made once for each of them."""
    rank, inputs, outputs = layer.coefficients.shape[2], hidden.shape[1], out.shape[1]
    weights = np.empty(rank, dtype=np.float32)
    for group in range(len(links.starts) - 1):
        first, last = links.starts[group], links.starts[group + 1]
        if links.targets[first] >= len(out):
            continue
        place = _MEASURED_PLACE[links.relations[first]]
        if links.relations[first] == _WALL_PERSON:
            heard = np.zeros((rank, inputs), dtype=np.float32)
            for link in range(first, last):
                _read(layer, place, links.lengths[link], weights)
                _spread(weights, hidden[links.sources[link]], heard)
            out[links.targets[first]] += np.dot(heard.reshape(-1), layer.aggregate[place])
        else:
            said = np.dot(hidden[links.sources[first]], layer.project[place]).reshape(rank, outputs)
            for link in range(first, last):
                _read(layer, place, links.lengths[link], weights)
                _gather(weights, said, out[links.targets[link]])


@njit
def _spread(weights: Float32Array, values: Float32Array, rows: Float32Array) -> None:
    """Add the values to every row, times its weight. Tabulated networks have two weights that are not 0."""
    for k in range(len(weights)):
        if weights[k] != 0:
            for i in range(len(values)):
                rows[k, i] += weights[k] * values[i]


@njit
def _gather(weights: Float32Array, rows: Float32Array, values: Float32Array) -> None:
    """Add every row to the values, times its weight."""
    for k in range(len(weights)):
        if weights[k] != 0:
            for i in range(len(values)):
                values[i] += weights[k] * rows[k, i]


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
