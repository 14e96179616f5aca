"""The graph attention network's arithmetic on flat windows, in compiled code (Velickovic et al. 2018, eq. 1 to 6).

A head's attention to an edge is a_l . W h_source + a_r . W h_target. Both terms are linear in the node, so they are
columns beside W's: one product for all nodes gives their messages and both terms of every head's attention.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from reward_model.base.arrays import Float32Array, IntArray
from reward_model.base.numba import njit
from reward_model.fast.elu import apply_elu
from reward_model.fast.grouped_window import FEATURES, NUM_KINDS, NUM_MANY_TO_ONE, Edges, Nodes, flat_windows
from reward_model.fast.matmul import add_product
from reward_model.graph.features import NUM_FRAMES
from reward_model.graph.packing import Stack

_NUM_FEATURES = tuple(map(len, FEATURES))


class AttentionNetwork(NamedTuple):
    """A GAT, ready for compiled code.

    Attributes:
        weights: the concatenated arrays of all layers
        shapes: (num_layers, 5) the offset and sizes of each layer's arrays, as `gat_layer_at` reads them
    """

    weights: Float32Array
    shapes: IntArray


class GATLayer(NamedTuple):
    """One layer's arrays.

    Attributes:
        matrices: (kinds * in, width) by kind of node in the first layer, else the same for all (kinds = 1); the heads'
            messages side by side, then the sender's term of each head's attention (a_l), the receiver's (a_r), and
            padding
        bias: (heads * out,)
        heads, outputs: number of heads, and of outputs of each head
        slope: of the attention's leaky ReLU
    """

    matrices: Float32Array
    bias: Float32Array
    heads: int
    outputs: int
    slope: float


class _Incoming(NamedTuple):
    """Edges by target: `starts` (num_nodes + 1,) the first edge of each node, `sources` (num_edges,) source nodes."""

    starts: IntArray
    sources: IntArray


@njit
def score_by_attention(stack: Stack, scores: Float32Array, network: AttentionNetwork) -> None:
    """Write q1 and q2 of each window, (num_windows, 2): the mean of the last layer's heads at its newest room."""
    nodes, edges = flat_windows(stack)
    incoming = _incoming(nodes, edges)
    num_windows = len(stack.sizes)
    hidden, last = nodes.features, len(network.shapes) - 1
    layer = gat_layer_at(network.weights, network.shapes[0])
    for index in range(last + 1):
        layer = gat_layer_at(network.weights, network.shapes[index])
        projected = _project_features(nodes, layer, hidden) if index == 0 else _project(layer, hidden)
        # Nodes that still reach the newest rooms: all nodes of the newest frames, and the rooms of the next one.
        num_sections = min((last - index) * NUM_KINDS + 1, NUM_FRAMES * NUM_KINDS)
        num_nodes = nodes.starts[num_sections * num_windows]
        hidden = _aggregate(incoming, layer, projected, _attention(incoming, layer, projected, num_nodes), num_nodes)
        if index < last:
            apply_elu(hidden)
    for window in range(num_windows):
        for column in range(layer.outputs):
            mean = np.float32(0)
            for head in range(layer.heads):
                mean += hidden[window, head * layer.outputs + column] / np.float32(layer.heads)
            scores[window, column] = max(mean, np.float32(0))


@njit
def gat_layer_at(weights: Float32Array, shape: IntArray) -> GATLayer:
    """Views of a layer's arrays; shape: their offset, rows and columns of the matrices, heads, outputs."""
    start, rows, columns, heads, outputs = shape[0], shape[1], shape[2], shape[3], shape[4]
    bias = start + rows * columns
    slope = bias + heads * outputs
    matrices = weights[start:bias].reshape(rows, columns)
    return GATLayer(matrices, weights[bias:slope], heads, outputs, weights[slope])


@njit
def _incoming(nodes: Nodes, edges: Edges) -> _Incoming:
    """All edges by target, self edges and temporal edges included."""
    num_nodes = len(nodes.newer)
    starts = np.zeros(num_nodes + 2, dtype=np.int64)  # one place further on until all sources are in
    for node in range(num_nodes):
        starts[node + 2] = 1 + (nodes.newer[node] >= 0) + (nodes.older[node] >= 0)
    first_one_to_many = edges.bounds[NUM_MANY_TO_ONE, 0]
    for group in range(len(edges.centres)):
        for edge in range(edges.starts[group], edges.starts[group + 1]):
            starts[(edges.centres[group] if group < first_one_to_many else edges.others[edge]) + 2] += 1
    for node in range(num_nodes):
        starts[node + 2] += starts[node + 1]
    sources = np.empty(starts[num_nodes + 1], dtype=np.int64)
    for node in range(num_nodes):
        for source in (node, nodes.newer[node], nodes.older[node]):
            if source >= 0:
                sources[starts[node + 1]] = source
                starts[node + 1] += 1
    for group in range(len(edges.centres)):
        centre = edges.centres[group]
        for edge in range(edges.starts[group], edges.starts[group + 1]):
            other = edges.others[edge]
            source, target = (other, centre) if group < first_one_to_many else (centre, other)
            sources[starts[target + 1]] = source
            starts[target + 1] += 1
    return _Incoming(starts[: num_nodes + 1], sources)


@njit
def _project_features(nodes: Nodes, layer: GATLayer, hidden: Float32Array) -> Float32Array:
    """The first layer's projections; its matrices have rows for those features alone that a kind of node has."""
    num_windows = (len(nodes.starts) - 1) // (NUM_FRAMES * NUM_KINDS)
    projected = np.zeros((len(hidden), layer.matrices.shape[1]), dtype=np.float32)
    for section in range(NUM_FRAMES * NUM_KINDS):
        first, last = nodes.starts[section * num_windows], nodes.starts[(section + 1) * num_windows]
        kind = section % NUM_KINDS
        matrix = kind * hidden.shape[1]
        add_product(hidden, first, 0, layer.matrices, matrix, projected, first, last - first, _NUM_FEATURES[kind])
    return projected


@njit
def _project(layer: GATLayer, hidden: Float32Array) -> Float32Array:
    projected = np.zeros((len(hidden), layer.matrices.shape[1]), dtype=np.float32)
    add_product(hidden, 0, 0, layer.matrices, 0, projected, 0, len(hidden), hidden.shape[1])
    return projected


@njit
def _attention(incoming: _Incoming, layer: GATLayer, projected: Float32Array, num_nodes: int) -> Float32Array:
    """Attention (num_edges, heads) to the first nodes' incoming edges; it sums to 1 over the edges of a node."""
    heads, slope = layer.heads, layer.slope
    from_column = heads * layer.outputs
    to_column = from_column + heads
    attention = np.empty((incoming.starts[num_nodes], heads), dtype=np.float32)
    for node in range(num_nodes):
        first, last = incoming.starts[node], incoming.starts[node + 1]
        for head in range(heads):
            highest = np.float32(-np.inf)
            for edge in range(first, last):
                score = projected[incoming.sources[edge], from_column + head] + projected[node, to_column + head]
                attention[edge, head] = score if score > 0 else slope * score
                highest = max(highest, attention[edge, head])
            for edge in range(first, last):
                attention[edge, head] -= highest
    apply_elu(attention)  # none is above 0, so this is exp(x) - 1
    for node in range(num_nodes):
        first, last = incoming.starts[node], incoming.starts[node + 1]
        for head in range(heads):
            total = np.float32(0)
            for edge in range(first, last):
                attention[edge, head] += np.float32(1)
                total += attention[edge, head]
            for edge in range(first, last):
                attention[edge, head] /= total
    return attention


@njit
def _aggregate(
    incoming: _Incoming, layer: GATLayer, projected: Float32Array, attention: Float32Array, num_nodes: int
) -> Float32Array:
    """Aggregated messages (num_nodes, heads * out): sums weighted by attention, plus the bias."""
    outputs = layer.outputs
    aggregated = np.empty((num_nodes, layer.heads * outputs), dtype=np.float32)
    for node in range(num_nodes):
        aggregated[node] = layer.bias
        row = aggregated[node]
        for edge in range(incoming.starts[node], incoming.starts[node + 1]):
            messages = projected[incoming.sources[edge]]  # views, since indexing the matrices takes four times as long
            for head in range(layer.heads):
                weight, first, last = attention[edge, head], head * outputs, (head + 1) * outputs
                of_head, of_row = messages[first:last], row[first:last]
                for column in range(outputs):
                    of_row[column] += weight * of_head[column]
    return aggregated
