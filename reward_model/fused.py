"""Windows through the factorised MPNN as one compiled function: what an environment's step waits for.

The arithmetic is that of `reward_model.compiled` without padding and without a framework between the products. A few
windows go through each layer together, so that its matrices are fetched once for all of them; `reward_model.tiles`
sees to it that a window's answer does not depend on the others.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from collections.abc import Sequence as Items
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial
from itertools import pairwise
from typing import Final

import numpy as np
import torch

from reward_model.flat_layers import NUM_PLAIN, Layer, flat_layers, layer_at
from reward_model.flat_window import (
    FEATURES,
    NUM_KINDS,
    Edges,
    Nodes,
    Stack,
    flat_windows,
    stack_windows,
)
from reward_model.graph import NUM_FRAMES, FrameGraph, Relation
from reward_model.jit import njit
from reward_model.measured_edges import OnCurves, add_meeting, add_parting, on_curves
from reward_model.models.edge_networks import PLAIN, LayerOperators
from reward_model.packed_frames import Float32Array
from reward_model.scenario import IntArray
from reward_model.scoring import Scoring, scoring_together
from reward_model.tiles import add_product

_SELF: Final = PLAIN.index(Relation.SELF)
_TO_OLDER: Final = (PLAIN.index(Relation.NOW_TO_SECOND), PLAIN.index(Relation.SECOND_TO_THIRD))
_TO_NEWER: Final = (PLAIN.index(Relation.SECOND_TO_NOW), PLAIN.index(Relation.THIRD_TO_SECOND))

_TOGETHER: Final = 8  # windows that go through the layers together; what they need stays in a core's own cache
_NUM_FEATURES: Final = tuple(map(len, FEATURES))
_LEAST_SHARE: Final = 4  # windows that are worth a thread of their own
_LEAST_GROUPS: Final = 4  # of windows that come one by one: for the first the threads wait, for the last the caller
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
        threads = _threads(num_shares - 1)
        others = [threads.submit(self._score, windows[share], scores[share]) for share in shares[1:]]
        self._score(windows[shares[0]], scores[shares[0]])
        for other in others:
            other.result()
        return scores

    def begin(self, num_windows: int) -> Scoring:
        """Take so many windows one by one; all threads but the caller's score the first ones meanwhile."""
        num_threads = torch.get_num_threads() - 1
        group_size = min(_TOGETHER, num_windows // _LEAST_GROUPS)
        if num_threads < 1 or group_size < 1:
            return scoring_together(self)
        return Scoring(self._stacked, _threads(num_threads), group_size)

    def _stacked(self, windows: Items[Items[FrameGraph]]) -> Callable[[], Float32Array]:
        """Prepare a few windows, so that scoring them is a call of compiled code and no more."""
        return partial(self._score_stack, stack_windows(windows), np.empty((len(windows), 2), dtype=np.float32))

    def _score_stack(self, stack: Stack, scores: Float32Array) -> Float32Array:
        _score_windows(stack, self._weights, self._shapes, scores)
        return scores

    def _score(self, windows: Items[Items[FrameGraph]], scores: Float32Array) -> None:
        for start in range(0, len(windows), _TOGETHER):
            few = slice(start, start + _TOGETHER)
            self._score_stack(stack_windows(windows[few]), scores[few])


@cache
def _threads(count: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(count, thread_name_prefix="scorer")


os.register_at_fork(after_in_child=_threads.cache_clear)  # threads do not come along into a forked process


@njit
def _score_windows(stack: Stack, weights: Float32Array, shapes: IntArray, scores: Float32Array) -> None:
    nodes, edges = flat_windows(stack)
    hidden, last = nodes.features, len(shapes) - 1
    curves = on_curves(layer_at(weights, shapes[0]), edges, min(NUM_FRAMES, last))
    for index in range(last + 1):
        layer = layer_at(weights, shapes[index])
        # Only what the newest rooms can still hear in the layers left: all of so many frames, and the next one's rooms.
        whole = min(NUM_FRAMES, last - index)
        if index > 0 and shapes[index, 7] == 0:
            curves = on_curves(layer, edges, whole)
        hidden = _all_nodes(nodes, edges, layer, curves, hidden, whole)
        if index < last:
            _apply_elu(hidden)
    scores[:] = np.maximum(hidden[: len(scores), :2], np.float32(0))


@njit
def _all_nodes(
    nodes: Nodes, edges: Edges, layer: Layer, curves: OnCurves, hidden: Float32Array, whole: int
) -> Float32Array:
    """One layer for all nodes of so many frames, and for the rooms of the next."""
    num_windows = (len(nodes.starts) - 1) // (NUM_FRAMES * NUM_KINDS)
    num_sections = min(whole * NUM_KINDS + 1, NUM_FRAMES * NUM_KINDS)
    out = np.zeros((nodes.starts[num_sections * num_windows], layer.bias.shape[0]), dtype=np.float32)
    inputs = hidden.shape[1]
    by_kind = len(layer.plain) > NUM_PLAIN * inputs
    for section in range(num_sections):
        first, last = nodes.starts[section * num_windows], nodes.starts[(section + 1) * num_windows]
        time, kind = section // NUM_KINDS, section % NUM_KINDS
        matrices, inner = (kind * NUM_PLAIN, _NUM_FEATURES[kind]) if by_kind else (0, inputs)
        add_product(hidden, first, 0, layer.plain, (matrices + _SELF) * inputs, out, first, last - first, inner)
        if time > 0:
            matrix = (matrices + _TO_OLDER[time - 1]) * inputs
            _add_neighbours(hidden, nodes.newer, layer.plain, matrix, out, first, last, inner)
        if time + 1 < NUM_FRAMES:
            matrix = (matrices + _TO_NEWER[time]) * inputs
            _add_neighbours(hidden, nodes.older, layer.plain, matrix, out, first, last, inner)
    add_meeting(edges, layer, curves, hidden, out, whole)
    add_parting(edges, layer, curves, hidden, out, whole)
    for node in range(len(out)):
        for column in range(out.shape[1]):
            out[node, column] = out[node, column] * nodes.shares[node] + layer.bias[column]
    return out


@njit
def _add_neighbours(
    hidden: Float32Array,
    places: IntArray,
    matrices: Float32Array,
    matrix: int,
    out: Float32Array,
    first: int,
    last: int,
    inner: int,
) -> None:
    """What nodes hear from themselves in another frame, where they are in it; `matrix`: the row where theirs begins."""
    while first < last:
        run = _run(places, first, last)
        if places[first] >= 0:
            add_product(hidden, places[first], 0, matrices, matrix, out, first, run, inner)
        first += run


@njit
def _run(places: IntArray, first: int, last: int) -> int:
    """How many places from the first on follow each other, one by one."""
    end = first + 1
    while end < last and places[end] == places[end - 1] + 1:
        end += 1
    return end - first


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


assert len(PLAIN) == 2 * NUM_FRAMES - 1
