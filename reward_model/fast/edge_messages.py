"""Messages along edges that have a length: what nodes hear in groups that meet at one node or part from one.

A relation's matrix is a sum of a few with coefficients that depend on the length. Where edges meet, what they carry is
summed up before it is multiplied; where they part, it is multiplied before it is shared out. Our own networks have a
matrix for each of a few lengths and are linear in between: an edge needs two of them, a group those around its edges.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from reward_model.base.arrays import Float32Array, IntArray
from reward_model.base.numba import njit
from reward_model.fast.grouped_window import NUM_GROUPED, NUM_INTO_ROOM, NUM_MEETING, Edges
from reward_model.fast.matmul import LANES, add_product, tile_1_1, tile_2_1
from reward_model.fast.relational_weights import Layer
from reward_model.graph.windows import NUM_FRAMES

_ONE: Final = np.float32(1.0)


class OnCurves(NamedTuple):
    """Where edges are on their relations' curves: an edge's matrix is a sum of a few that stand side by side.

    matrices: (num_edges,) the first of the relation's matrices in the sum
    coefficients: (num_edges, width) of it and of those that follow
    used: (num_groups, rank) the matrices that a group's edges need
    """

    matrices: IntArray
    coefficients: Float32Array
    used: NDArray[np.bool_]


@njit
def on_curves(layer: Layer, edges: Edges, whole: int) -> OnCurves:
    """Look every edge's length up in its relation's table; edges that only older frames need are left out."""
    columns = layer.tables.shape[2]
    width = 2 if columns == 0 else columns
    matrices, coefficients = np.zeros(len(edges.lengths), np.int64), np.empty((len(edges.lengths), width), np.float32)
    used = np.zeros((len(edges.centres), layer.rank), dtype=np.bool_)
    for relation in range(NUM_GROUPED):
        knots, table = layer.knots[relation], layer.tables[relation]
        for group in range(edges.bounds[relation, 0], edges.bounds[relation, min(whole + 1, NUM_FRAMES)]):
            for edge in range(edges.starts[group], edges.starts[group + 1]):
                knot = _last_knot(knots, edges.lengths[edge])
                share = (edges.lengths[edge] - knots[knot]) / (knots[knot + 1] - knots[knot])
                if columns == 0:
                    matrices[edge], coefficients[edge, 0], coefficients[edge, 1] = knot, _ONE - share, share
                for column in range(columns):
                    coefficients[edge, column] = table[knot, column] * (_ONE - share) + table[knot + 1, column] * share
                for matrix in range(matrices[edge], matrices[edge] + width):
                    used[group, matrix] = True
    return OnCurves(matrices, coefficients, used)


@njit
def relation_shares(edges: Edges, num_nodes: int) -> OnCurves:
    """For networks with one matrix a relation, where a node averages what it hears over its edges of a relation."""
    num_edges = len(edges.lengths)
    coefficients, counts = np.empty((num_edges, 1), dtype=np.float32), np.empty(num_nodes, dtype=np.int64)
    targets = np.empty(num_edges, dtype=np.int64)
    for relation in range(NUM_GROUPED):
        first_group, last_group = edges.bounds[relation, 0], edges.bounds[relation, NUM_FRAMES]
        counts[:] = 0
        for group in range(first_group, last_group):
            for edge in range(edges.starts[group], edges.starts[group + 1]):
                targets[edge] = edges.centres[group] if relation < NUM_MEETING else edges.others[edge]
                counts[targets[edge]] += 1
        for edge in range(edges.starts[first_group], edges.starts[last_group]):
            coefficients[edge, 0] = _ONE / np.float32(counts[targets[edge]])
    used = np.ones((len(edges.centres), 1), dtype=np.bool_)
    return OnCurves(np.zeros(num_edges, dtype=np.int64), coefficients, used)


@njit
def _last_knot(knots: Float32Array, length: float) -> int:
    """The last knot that is not beyond a length, but for the very last one."""
    first, count = 0, len(knots) - 1
    while count > 1:
        half = count // 2
        if knots[first + half] <= length:
            first += half
        count -= half
    return first


@njit
def add_meeting(
    edges: Edges, layer: Layer, curves: OnCurves, hidden: Float32Array, out: Float32Array, whole: int
) -> None:
    """What meets in a node is summed up before it is multiplied."""
    rank, inputs = layer.rank, hidden.shape[1]
    turned = curves.coefficients.T
    for relation in range(NUM_MEETING):
        times = min(whole + 1, NUM_FRAMES) if relation < NUM_INTO_ROOM else whole
        first, last = edges.bounds[relation, 0], edges.bounds[relation, times]
        rows, nodes = np.arange(last - first) * rank, edges.centres[first:last]
        heard = np.zeros(((last - first) * rank, inputs), dtype=np.float32)
        for group in range(first, last):
            _sum_up(edges, curves, turned, group, hidden, heard, rows[group - first])
        if curves.coefficients.shape[1] == rank:
            _multiply_all(heard.reshape(last - first, rank * inputs), layer.measured, relation, out, nodes)
        else:
            _multiply(heard, rows, 1, layer.measured, relation, curves.used[first:last], out, nodes, 0)


@njit
def _sum_up(
    edges: Edges,
    curves: OnCurves,
    turned: Float32Array,
    group: int,
    hidden: Float32Array,
    heard: Float32Array,
    row: int,
) -> None:
    """Add a group's other ends to the rows of the matrices that they will be multiplied with, from `row` on."""
    edge, end, width = edges.starts[group], edges.starts[group + 1], len(turned)
    while edge < end:
        run, matrix = _alike(edges.others, curves.matrices, edge, end), row + curves.matrices[edge]
        if width == 2:
            for column in range(0, hidden.shape[1], LANES):
                tile_2_1(turned, 0, edge, hidden, edges.others[edge], heard, matrix, column, run)
        else:
            add_product(turned, 0, edge, hidden, edges.others[edge], heard, matrix, width, run)
        edge += run


@njit
def add_parting(
    edges: Edges, layer: Layer, curves: OnCurves, hidden: Float32Array, out: Float32Array, whole: int
) -> None:
    """What parts from a node is multiplied before it is shared out."""
    for relation in range(NUM_MEETING, NUM_GROUPED):
        first, last = edges.bounds[relation, 0], edges.bounds[relation, whole]
        rows, nodes = np.arange(last - first) * layer.rank, edges.centres[first:last]
        said = np.zeros(((last - first) * layer.rank, out.shape[1]), dtype=np.float32)
        _multiply(hidden, nodes, 0, layer.measured, relation, curves.used[first:last], said, rows, 1)
        for group in range(first, last):
            _share_out(edges, curves, group, said, rows[group - first], out)


@njit
def _share_out(edges: Edges, curves: OnCurves, group: int, said: Float32Array, row: int, out: Float32Array) -> None:
    """Add to a group's other ends what the products from `row` on have for them."""
    edge, end, width = edges.starts[group], edges.starts[group + 1], curves.coefficients.shape[1]
    while edge < end:
        run, matrix = 1, row + curves.matrices[edge]
        if width == 2:
            for column in range(0, out.shape[1], LANES):
                tile_1_1(curves.coefficients, edge, 0, said, matrix, out, edges.others[edge], column, width)
        else:
            run = _alike(edges.others, curves.matrices, edge, end)
            add_product(curves.coefficients, edge, 0, said, matrix, out, edges.others[edge], run, width)
        edge += run


@njit
def _alike(others: IntArray, matrices: IntArray, edge: int, end: int) -> int:
    """How many edges from one on have the same matrices and, at their other ends, nodes that follow each other."""
    last = edge + 1
    while last < end and others[last] == others[last - 1] + 1 and matrices[last] == matrices[edge]:
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
    """Add to rows of `target` the products of rows of `source` with those of a relation's matrices that are used.

    Each group of edges has a row in either; a step of 1 means that the group's next matrix has the next row.
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
