"""Messages along edges that have a length, in groups of edges that share their receiver or their sender.

A relation's matrix is a sum of a few matrices with coefficients that depend on the length. In a many-to-one group the
senders' features are aggregated before they are multiplied; in a one-to-many group the sender's features are multiplied
before the products are scattered to the receivers. Networks with tabulated edges have a matrix at each of a few lengths
and interpolate linearly: an edge needs two of them, a group those around the lengths of its edges.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from reward_model.base.arrays import Float32Array, IntArray
from reward_model.base.numba import njit
from reward_model.fast.grouped_window import NUM_GROUPED, NUM_INTO_ROOM, NUM_MANY_TO_ONE, Edges
from reward_model.fast.matmul import LANES, add_one_vector, add_product
from reward_model.fast.relational_weights import Layer
from reward_model.graph.features import NUM_FRAMES

_ONE: Final = np.float32(1.0)


class EdgeMatrices(NamedTuple):
    """The matrix of each edge: a sum, with coefficients, of a few consecutive matrices of its relation.

    Attributes:
        first: (num_edges,) the first of the relation's matrices in the sum
        coefficients: (num_edges, width) of this matrix and of the following ones
        used: (num_groups, rank) whether a group's edges use a matrix
    """

    first: IntArray
    coefficients: Float32Array
    used: NDArray[np.bool_]


@njit
def find_edge_matrices(layer: Layer, edges: Edges, num_full_frames: int) -> EdgeMatrices:
    """The matrices of edges by their lengths, from tables; edges that only older frames need are left out."""
    columns = layer.tables.shape[2]
    width = 2 if columns == 0 else columns
    first, coefficients = np.zeros(len(edges.lengths), np.int64), np.empty((len(edges.lengths), width), np.float32)
    used = np.zeros((len(edges.centres), layer.rank), dtype=np.bool_)
    for relation in range(NUM_GROUPED):
        knots, table = layer.knots[relation], layer.tables[relation]
        for group in range(edges.bounds[relation, 0], edges.bounds[relation, min(num_full_frames + 1, NUM_FRAMES)]):
            for edge in range(edges.starts[group], edges.starts[group + 1]):
                knot = _last_knot(knots, edges.lengths[edge])
                share = (edges.lengths[edge] - knots[knot]) / (knots[knot + 1] - knots[knot])
                if columns == 0:
                    first[edge], coefficients[edge, 0], coefficients[edge, 1] = knot, _ONE - share, share
                for column in range(columns):
                    coefficients[edge, column] = table[knot, column] * (_ONE - share) + table[knot + 1, column] * share
                for matrix in range(first[edge], first[edge] + width):
                    used[group, matrix] = True
    return EdgeMatrices(first, coefficients, used)


@njit
def relation_means(edges: Edges, num_nodes: int) -> EdgeMatrices:
    """The same for networks with one matrix a relation, whose nodes average the messages of each relation."""
    num_edges = len(edges.lengths)
    coefficients, counts = np.empty((num_edges, 1), dtype=np.float32), np.empty(num_nodes, dtype=np.int64)
    targets = np.empty(num_edges, dtype=np.int64)
    for relation in range(NUM_GROUPED):
        first_group, last_group = edges.bounds[relation, 0], edges.bounds[relation, NUM_FRAMES]
        counts[:] = 0
        for group in range(first_group, last_group):
            for edge in range(edges.starts[group], edges.starts[group + 1]):
                targets[edge] = edges.centres[group] if relation < NUM_MANY_TO_ONE else edges.others[edge]
                counts[targets[edge]] += 1
        for edge in range(edges.starts[first_group], edges.starts[last_group]):
            coefficients[edge, 0] = _ONE / np.float32(counts[targets[edge]])
    used = np.ones((len(edges.centres), 1), dtype=np.bool_)
    return EdgeMatrices(np.zeros(num_edges, dtype=np.int64), coefficients, used)


@njit
def _last_knot(knots: Float32Array, length: float) -> int:
    """The index of the last knot that is not beyond a length, the table's last knot excepted."""
    first, count = 0, len(knots) - 1
    while count > 1:
        half = count // 2
        if knots[first + half] <= length:
            first += half
        count -= half
    return first


@njit
def add_many_to_one(
    edges: Edges,
    layer: Layer,
    edge_matrices: EdgeMatrices,
    hidden: Float32Array,
    out: Float32Array,
    num_full_frames: int,
) -> None:
    """Add the messages of many-to-one groups: the senders' features are aggregated, then multiplied."""
    rank, inputs = layer.rank, hidden.shape[1]
    transposed = edge_matrices.coefficients.T
    for relation in range(NUM_MANY_TO_ONE):
        times = min(num_full_frames + 1, NUM_FRAMES) if relation < NUM_INTO_ROOM else num_full_frames
        first, last = edges.bounds[relation, 0], edges.bounds[relation, times]
        rows, nodes = np.arange(last - first) * rank, edges.centres[first:last]
        aggregated = np.zeros(((last - first) * rank, inputs), dtype=np.float32)
        for group in range(first, last):
            _aggregate(edges, edge_matrices, transposed, group, hidden, aggregated, rows[group - first])
        if edge_matrices.coefficients.shape[1] == rank:
            _multiply_all(aggregated.reshape(last - first, rank * inputs), layer.measured, relation, out, nodes)
        else:
            _multiply(aggregated, rows, 1, layer.measured, relation, edge_matrices.used[first:last], out, nodes, 0)


@njit
def _aggregate(
    edges: Edges,
    edge_matrices: EdgeMatrices,
    transposed: Float32Array,
    group: int,
    hidden: Float32Array,
    aggregated: Float32Array,
    row: int,
) -> None:
    """Add the features of a group's senders to the rows of `aggregated`, one for each matrix, from `row` on."""
    edge, end, width = edges.starts[group], edges.starts[group + 1], len(transposed)
    while edge < end:
        run, matrix = _run_length(edges.others, edge_matrices.first, edge, end), row + edge_matrices.first[edge]
        if width == 2:
            for column in range(0, hidden.shape[1], LANES):
                add_one_vector(transposed, 0, edge, hidden, edges.others[edge], aggregated, matrix, column, 2, run)
        else:
            add_product(transposed, 0, edge, hidden, edges.others[edge], aggregated, matrix, width, run)
        edge += run


@njit
def add_one_to_many(
    edges: Edges,
    layer: Layer,
    edge_matrices: EdgeMatrices,
    hidden: Float32Array,
    out: Float32Array,
    num_full_frames: int,
) -> None:
    """Add the messages of one-to-many groups: the sender's features are multiplied, then scattered."""
    for relation in range(NUM_MANY_TO_ONE, NUM_GROUPED):
        first, last = edges.bounds[relation, 0], edges.bounds[relation, num_full_frames]
        rows, nodes = np.arange(last - first) * layer.rank, edges.centres[first:last]
        messages = np.zeros(((last - first) * layer.rank, out.shape[1]), dtype=np.float32)
        _multiply(hidden, nodes, 0, layer.measured, relation, edge_matrices.used[first:last], messages, rows, 1)
        for group in range(first, last):
            _scatter(edges, edge_matrices, group, messages, rows[group - first], out)


@njit
def _scatter(
    edges: Edges, edge_matrices: EdgeMatrices, group: int, messages: Float32Array, row: int, out: Float32Array
) -> None:
    """Add the products from `row` on to the receivers of a group, each times its edge's coefficient."""
    edge, end, width = edges.starts[group], edges.starts[group + 1], edge_matrices.coefficients.shape[1]
    while edge < end:
        run, matrix = 1, row + edge_matrices.first[edge]
        if width == 2:
            for column in range(0, out.shape[1], LANES):
                add_one_vector(
                    edge_matrices.coefficients, edge, 0, messages, matrix, out, edges.others[edge], column, 1, width
                )
        else:
            run = _run_length(edges.others, edge_matrices.first, edge, end)
            add_product(edge_matrices.coefficients, edge, 0, messages, matrix, out, edges.others[edge], run, width)
        edge += run


@njit
def _run_length(others: IntArray, first_matrices: IntArray, edge: int, end: int) -> int:
    """The number of edges, from `edge` on, with the same matrices and with consecutive nodes at their other ends."""
    last = edge + 1
    while last < end and others[last] == others[last - 1] + 1 and first_matrices[last] == first_matrices[edge]:
        last += 1
    return last - edge


@njit
def _multiply(
    source: Float32Array,
    source_rows: IntArray,
    source_step: int,
    measured: Float32Array,
    relation: int,
    used: NDArray[np.bool_],
    target: Float32Array,
    target_rows: IntArray,
    target_step: int,
) -> None:
    """Add the products of rows of `source` with the used matrices of a relation to rows of `target`.

    Each group of edges has a row in both; with a step of 1, the group's next matrix has the next row.
    """
    inputs, outputs = source.shape[1], target.shape[1]
    factors, groups = np.empty((len(used), inputs), dtype=np.float32), np.empty(len(used), dtype=np.int64)
    products = np.empty((len(used), outputs), dtype=np.float32)
    rank = used.shape[1]
    for matrix in range(rank):
        count = 0
        for group in range(len(used)):
            if used[group, matrix]:
                row = source_rows[group] + matrix * source_step
                for column in range(inputs):
                    factors[count, column] = source[row, column]
                groups[count] = group
                count += 1
        products[:count] = 0
        add_product(factors, 0, 0, measured, (relation * rank + matrix) * inputs, products, 0, count, inputs)
        for index in range(count):
            row = target_rows[groups[index]] + matrix * target_step
            for column in range(outputs):
                target[row, column] += products[index, column]


@njit
def _multiply_all(
    together: Float32Array, measured: Float32Array, relation: int, target: Float32Array, target_rows: IntArray
) -> None:
    """As `_multiply`, with all of a relation's matrices in one product; `together`: (groups, rank * in)."""
    inner = together.shape[1]
    products = np.zeros((len(together), target.shape[1]), dtype=np.float32)
    add_product(together, 0, 0, measured, relation * inner, products, 0, len(together), inner)
    for index in range(len(together)):
        for column in range(target.shape[1]):
            target[target_rows[index], column] += products[index, column]
