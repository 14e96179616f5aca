"""Windows through the factorised MPNN as one compiled function: what an environment's step waits for.

The arithmetic is that of `reward_model.compiled` without padding and without a framework between the products;
for a single window the framework is most of the cost. Where many rows meet one matrix the product goes to BLAS, the
rest are loops over nodes and links that skip zeros: of a node's features most are.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence as Items
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from typing import Final

import numpy as np
import torch

from reward_model.flat_layers import INTO_ROOM, NUM_ROOM_KINDS, OUT_OF_ROOM, ROOM_KINDS, Layer, flat_layers, layer_at
from reward_model.flat_window import Frames, Links, Nodes, join_frames, padded_frames
from reward_model.graph import (
    NUM_FRAMES,
    Float32Array,
    FrameGraph,
    NodeKind,
    Relation,
)
from reward_model.jit import njit
from reward_model.models.edge_networks import MEASURED, PLAIN, LayerOperators
from reward_model.scenario import IntArray

# by NodeKind: the place in ROOM_KINDS, -1 for the room
_ROOM_COLUMN: Final = tuple(ROOM_KINDS.index(kind) if kind in ROOM_KINDS else -1 for kind in NodeKind)
_SELF: Final = PLAIN.index(Relation.SELF)
_TO_OLDER: Final = (PLAIN.index(Relation.NOW_TO_SECOND), PLAIN.index(Relation.SECOND_TO_THIRD))
_TO_NEWER: Final = (PLAIN.index(Relation.SECOND_TO_NOW), PLAIN.index(Relation.THIRD_TO_SECOND))
# by Relation: its place among the measured ones, -1 for the others
_MEASURED_PLACE: Final = tuple(MEASURED.index(r) if r in MEASURED else -1 for r in Relation)
_WALL_PERSON: Final = int(Relation.WALL_PERSON)

_LEAST_SHARE: Final = 4  # windows that are worth a thread of their own
_LOWEST: Final = np.float32(-16.0)  # below it exp is nothing beside 1
_DOUBLINGS: Final = 6
_SCALE: Final = np.float32(1 / 2**_DOUBLINGS)
_TAYLOR: Final = tuple(np.float32(1 / math.factorial(power)) for power in range(1, 8))  # of expm1
_TWO: Final = np.float32(2.0)


class FusedMPNN:
    """A network turned into operators, ready to score windows on the CPU.

    It uses as many threads as PyTorch is set to. An answer depends on its window alone, to the last bit.
    """

    def __init__(self, operators: Items[LayerOperators]) -> None:
        self._weights, self._shapes = flat_layers(operators)

    def __call__(self, windows: Items[Items[FrameGraph]]) -> Float32Array:
        """(num_windows, 2) the scores of windows of up to three frames, newest first."""
        scores = np.empty((len(windows), 2), dtype=np.float32)
        num_shares = min(torch.get_num_threads(), len(windows) // _LEAST_SHARE)
        if num_shares <= 1:
            self._score(windows, scores)
            return scores
        ends = [len(windows) * share // num_shares for share in range(num_shares + 1)]
        shares = [slice(*pair) for pair in pairwise(ends)]
        others = [_threads().submit(self._score, windows[share], scores[share]) for share in shares[1:]]
        self._score(windows[shares[0]], scores[shares[0]])
        for other in others:
            other.result()
        return scores

    def _score(self, windows: Items[Items[FrameGraph]], scores: Float32Array) -> None:
        for window, row in zip(windows, scores, strict=True):
            _score_window(padded_frames(window), len(window), self._weights, self._shapes, row)


@cache
def _threads() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(thread_name_prefix="scorer")


os.register_at_fork(after_in_child=_threads.cache_clear)  # threads do not come along into a forked process


@njit
def _score_window(
    frames: Frames, num_frames: int, weights: Float32Array, shapes: IntArray, scores: Float32Array
) -> None:
    nodes, links = join_frames(frames, num_frames)
    hidden, last = nodes.features, len(shapes) - 1
    for index in range(last + 1):
        # Only what the newest room can still hear in the layers left: all of so many frames, and the next one's room.
        whole = min(num_frames, last - index)
        count = nodes.starts[whole] + (whole < num_frames)
        hidden = _all_nodes(nodes, links, layer_at(weights, shapes[index]), hidden, count)
        if index < last:
            _apply_elu(hidden)
    scores[:] = np.maximum(hidden[0], np.float32(0))


@njit
def _apply_elu(hidden: Float32Array) -> None:
    """ELU, exp(x) - 1 below 0, by its Taylor series near 0 and exp(2x) - 1 = (exp(x) - 1) (exp(x) - 1 + 2).

    Without a call in it, the loop handles several numbers at once; the library's expm1 takes a third of all time.
    """
    flat = hidden.reshape(-1)
    for place in range(len(flat)):
        value = flat[place]
        low = np.float32(0) if value > 0 else value
        low = _LOWEST if low < _LOWEST else low
        x = low * _SCALE
        y = x * (_TAYLOR[3] + x * (_TAYLOR[4] + x * (_TAYLOR[5] + x * _TAYLOR[6])))
        y = x * (_TAYLOR[0] + x * (_TAYLOR[1] + x * (_TAYLOR[2] + y)))
        for _ in range(_DOUBLINGS):
            y = y * (y + _TWO)
        flat[place] = value if value > 0 else y


@njit
def _all_nodes(nodes: Nodes, links: Links, layer: Layer, hidden: Float32Array, count: int) -> Float32Array:
    """One layer for the first `count` nodes."""
    out: Float32Array = np.dot(hidden[:count], layer.plain[_SELF])
    _add_temporal(nodes, layer, hidden, out)
    _add_to_room(nodes, layer, hidden, out)
    _add_from_room(nodes, layer, hidden, out)
    _add_links(links, layer, hidden, out)
    for node in range(count):
        for column in range(out.shape[1]):
            out[node, column] = out[node, column] * nodes.shares[node] + layer.bias[column]
    return out


@njit
def _add_temporal(nodes: Nodes, layer: Layer, hidden: Float32Array, out: Float32Array) -> None:
    """Everything to itself in the frames before and after. Of the last frame there may be the room alone."""
    starts, count = nodes.starts, len(out)
    for gap in range(len(starts) - 2):
        newer, older, end = starts[gap], starts[gap + 1], starts[gap + 2]
        if older < count:
            stop = older if end <= count else newer + 1
            said = np.dot(hidden[newer:stop], layer.plain[_TO_OLDER[gap]])
            for node in range(newer, stop):
                if 0 <= nodes.older[node] < count:
                    _add(said[node - newer], out[nodes.older[node]])
        if newer < count:
            stop = older if older <= count else newer + 1
            said = np.dot(hidden[older : end if older <= count else older + 1], layer.plain[_TO_NEWER[gap]])
            for node in range(newer, stop):
                if nodes.older[node] >= 0:
                    _add(said[nodes.older[node] - older], out[node])


@njit
def _add_to_room(nodes: Nodes, layer: Layer, hidden: Float32Array, out: Float32Array) -> None:
    """Everything to the room: summed before one product."""
    rank = layer.coefficients.shape[2]
    heard = np.empty((NUM_ROOM_KINDS * rank, hidden.shape[1]), dtype=np.float32)
    weights = np.empty(rank, dtype=np.float32)
    for frame in range(len(nodes.starts) - 1):
        room = nodes.starts[frame]
        if room >= len(out):
            break
        heard[:] = 0
        for node in range(room + 1, nodes.starts[frame + 1]):
            column = _ROOM_COLUMN[nodes.kinds[node]]
            _read(layer, INTO_ROOM[column], nodes.lengths[node], weights)
            _spread(weights, hidden[node], heard[column * rank : (column + 1) * rank])
        _add_product(heard.reshape(-1), layer.into_room, out[room])


@njit
def _add_from_room(nodes: Nodes, layer: Layer, hidden: Float32Array, out: Float32Array) -> None:
    """The room to everything: one product, then shared out."""
    rank = layer.coefficients.shape[2]
    said = np.empty(NUM_ROOM_KINDS * rank * out.shape[1], dtype=np.float32)
    rows = said.reshape(NUM_ROOM_KINDS * rank, out.shape[1])
    weights = np.empty(rank, dtype=np.float32)
    for frame in range(len(nodes.starts) - 1):
        if nodes.starts[frame + 1] > len(out):
            break
        said[:] = 0
        _add_product(hidden[nodes.starts[frame]], layer.out_of_room, said)
        for node in range(nodes.starts[frame] + 1, nodes.starts[frame + 1]):
            column = _ROOM_COLUMN[nodes.kinds[node]]
            _read(layer, OUT_OF_ROOM[column], nodes.lengths[node], weights)
            _gather(weights, rows[column * rank : (column + 1) * rank], out[node])


@njit
def _add_links(links: Links, layer: Layer, hidden: Float32Array, out: Float32Array) -> None:
    """Interactions and people near walls. Centres are few: products are made once for each of them."""
    rank, inputs, outputs = layer.coefficients.shape[2], hidden.shape[1], out.shape[1]
    weights = np.empty(rank, dtype=np.float32)
    heard, said = np.empty((rank, inputs), dtype=np.float32), np.empty((rank, outputs), dtype=np.float32)
    for group in range(len(links.starts) - 1):
        first, last = links.starts[group], links.starts[group + 1]
        if links.targets[first] >= len(out):
            continue
        place = _MEASURED_PLACE[links.relations[first]]
        if links.relations[first] == _WALL_PERSON:
            heard[:] = 0
            for link in range(first, last):
                _read(layer, place, links.lengths[link], weights)
                _spread(weights, hidden[links.sources[link]], heard)
            _add_product(heard.reshape(-1), layer.aggregate[place], out[links.targets[first]])
        else:
            said[:] = 0
            _add_product(hidden[links.sources[first]], layer.project[place], said.reshape(-1))
            for link in range(first, last):
                _read(layer, place, links.lengths[link], weights)
                _gather(weights, said, out[links.targets[link]])


@njit
def _add_product(values: Float32Array, matrix: Float32Array, out: Float32Array) -> None:
    """Add values @ matrix."""
    for i in range(len(values)):
        if values[i] != 0:
            for j in range(len(out)):
                out[j] += values[i] * matrix[i, j]


@njit
def _add(values: Float32Array, out: Float32Array) -> None:
    for i in range(len(out)):
        out[i] += values[i]


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
def _read(layer: Layer, place: int, length: float, weights: Float32Array) -> None:
    """The coefficients of a relation at a length, linear between and beyond the sampled lengths."""
    position = length / layer.steps[place]
    table = layer.coefficients[place]
    row = min(int(position), len(table) - 2)
    share = np.float32(position - row)
    for k in range(len(weights)):
        weights[k] = table[row, k] * (np.float32(1) - share) + table[row + 1, k] * share


assert len(PLAIN) == 2 * NUM_FRAMES - 1
