"""The arithmetic of networks with a matrix for each relation (MPNN and R-GCN) on grouped windows, in compiled code."""

from __future__ import annotations

from typing import Final

import numpy as np

from reward_model.base.arrays import Float32Array, IntArray
from reward_model.base.numba import njit
from reward_model.fast.edge_messages import (
    EdgeMatrices,
    add_many_to_one,
    add_one_to_many,
    find_edge_matrices,
    relation_means,
)
from reward_model.fast.elu import apply_elu
from reward_model.fast.grouped_window import FEATURES, NUM_KINDS, Edges, Nodes, flat_windows
from reward_model.fast.matmul import add_product
from reward_model.fast.relational_weights import NUM_PLAIN, Layer, RelationalNetwork, layer_at
from reward_model.graph.features import NUM_FRAMES, Relation
from reward_model.graph.packing import Stack
from reward_model.networks.edge_networks import PLAIN

_SELF: Final = PLAIN.index(Relation.SELF)
_TO_OLDER: Final = (PLAIN.index(Relation.NOW_TO_SECOND), PLAIN.index(Relation.SECOND_TO_THIRD))
_TO_NEWER: Final = (PLAIN.index(Relation.SECOND_TO_NOW), PLAIN.index(Relation.THIRD_TO_SECOND))
_NUM_FEATURES: Final = tuple(map(len, FEATURES))


@njit
def score_by_relation(stack: Stack, scores: Float32Array, network: RelationalNetwork) -> None:
    """Write q1 and q2 of each window, (num_windows, 2)."""
    nodes, edges = flat_windows(stack)
    weights, shapes = network.weights, network.shapes
    hidden, last = nodes.features, len(shapes) - 1
    if network.by_relation:
        scales = np.ones_like(nodes.inverse_degrees)
        edge_matrices = relation_means(edges, len(scales))
    else:
        scales = nodes.inverse_degrees
        edge_matrices = find_edge_matrices(layer_at(weights, shapes[0]), edges, min(NUM_FRAMES, last))
    for index in range(last + 1):
        layer = layer_at(weights, shapes[index])
        # Nodes that still reach the newest rooms: all nodes of the newest frames, and the rooms of the next one.
        num_full_frames = min(NUM_FRAMES, last - index)
        if index > 0 and shapes[index, 7] == 0:
            edge_matrices = find_edge_matrices(layer, edges, num_full_frames)
        hidden = _all_nodes(nodes, edges, layer, edge_matrices, hidden, num_full_frames, scales)
        if index < last:
            apply_elu(hidden)
    scores[:] = np.maximum(hidden[: len(scores), :2], np.float32(0))


@njit
def _all_nodes(
    nodes: Nodes,
    edges: Edges,
    layer: Layer,
    edge_matrices: EdgeMatrices,
    hidden: Float32Array,
    num_full_frames: int,
    scales: Float32Array,
) -> Float32Array:
    """One layer for all nodes of the newest frames and the rooms of the next; `scales`: factor of each node's sum."""
    num_windows = (len(nodes.starts) - 1) // (NUM_FRAMES * NUM_KINDS)
    num_sections = min(num_full_frames * NUM_KINDS + 1, NUM_FRAMES * NUM_KINDS)
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
    add_many_to_one(edges, layer, edge_matrices, hidden, out, num_full_frames)
    add_one_to_many(edges, layer, edge_matrices, hidden, out, num_full_frames)
    for node in range(len(out)):
        for column in range(out.shape[1]):
            out[node, column] = out[node, column] * scales[node] + layer.bias[column]
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
    """Add the messages along temporal edges; `matrix`: the first row of their matrix."""
    while first < last:
        run = _run_length(places, first, last)
        if places[first] >= 0:
            add_product(hidden, places[first], 0, matrices, matrix, out, first, run, inner)
        first += run


@njit
def _run_length(places: IntArray, first: int, last: int) -> int:
    """The number of consecutive places from the first on."""
    end = first + 1
    while end < last and places[end] == places[end - 1] + 1:
        end += 1
    return end - first


assert len(PLAIN) == 2 * NUM_FRAMES - 1
