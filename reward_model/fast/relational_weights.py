"""The weights of networks with matrices by relation as one flat array, from which compiled code takes its views.

Passing arrays to compiled code takes time for each of them, and a network has dozens. All widths are padded with zeros
to multiples of `LANES`, and the first layer's matrices have rows for those features alone that a kind of node has.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from reward_model.base.arrays import Float32Array, IntArray
from reward_model.base.numba import njit
from reward_model.fast.grouped_window import (
    FEATURES,
    GROUPED,
    KINDS,
    MANY_TO_ONE,
    NUM_GROUPED,
    NUM_KINDS,
)
from reward_model.fast.matmul import LANES
from reward_model.graph.features import NodeKind, Relation
from reward_model.graph.packing import NUM_PACKED
from reward_model.networks.edge_networks import MEASURED, PLAIN, LayerOperators

NUM_PLAIN: Final = len(PLAIN)
_SOURCE_KINDS: Final = {
    Relation.OBJECT_PERSON: NodeKind.OBJECT,
    Relation.PERSON_OBJECT: NodeKind.PERSON,
    Relation.PERSON_PERSON: NodeKind.PERSON,
    Relation.PERSON_WALL: NodeKind.PERSON,
    Relation.WALL_PERSON: NodeKind.WALL,
}


class RelationalNetwork(NamedTuple):
    """An MPNN or an R-GCN, ready for compiled code.

    Attributes:
        weights: the concatenated arrays of all layers
        shapes: (num_layers, 8) the offset and sizes of each layer's arrays, as `layer_at` reads them; the last column
            is whether its tables are those of the layer before
        by_relation: whether a node averages its messages over the edges of each relation, as in an R-GCN, or over all
            edges
    """

    weights: Float32Array
    shapes: IntArray
    by_relation: bool


class Layer(NamedTuple):
    """One layer's arrays, laid out for matrix products.

    Attributes:
        plain: (kinds * 5 * in, out) by kind of node, in the first layer, else the same for all (kinds = 1)
        measured: (13 * rank * in, out) by `GROUPED`
        rank: number of matrices of a relation
        knots: (13, num_knots)
        tables: (13, num_knots, rank), or (13, num_knots, 0) where there is a matrix for each knot
        bias: (out,)
    """

    plain: Float32Array
    measured: Float32Array
    rank: int
    knots: Float32Array
    tables: Float32Array
    bias: Float32Array


def flat_layers(operators: Sequence[LayerOperators], by_relation: bool = False) -> RelationalNetwork:
    """Flatten the operators of an MPNN, or of an R-GCN whose `basis` has one matrix a relation."""
    layers = [_layer_arrays(layer, first=index == 0) for index, layer in enumerate(operators)]
    parts = [(layer.plain, layer.measured, layer.knots, layer.tables, layer.bias) for layer in layers]
    sizes = [sum(part.size for part in arrays) for arrays in parts]
    starts = np.cumsum([0, *sizes[:-1]])
    shapes = [_shape(layer, _same_tables(layers, index), first=index == 0) for index, layer in enumerate(layers)]
    weights = np.concatenate([part.ravel() for arrays in parts for part in arrays])
    return RelationalNetwork(weights, np.column_stack([starts, np.array(shapes, dtype=np.int64)]), by_relation)


@njit
def layer_at(weights: Float32Array, shape: IntArray) -> Layer:
    """Views of a layer's arrays."""
    start, kinds, inputs, outputs = shape[0], shape[1], shape[2], shape[3]
    rank, knots, columns = shape[4], shape[5], shape[6]
    measured = start + kinds * NUM_PLAIN * inputs * outputs
    places = measured + NUM_GROUPED * rank * inputs * outputs
    tables = places + NUM_GROUPED * knots
    bias = tables + NUM_GROUPED * knots * columns
    return Layer(
        weights[start:measured].reshape(kinds * NUM_PLAIN * inputs, outputs),
        weights[measured:places].reshape(NUM_GROUPED * rank * inputs, outputs),
        rank,
        weights[places:tables].reshape(NUM_GROUPED, knots),
        weights[tables:bias].reshape(NUM_GROUPED, knots, columns),
        weights[bias : bias + outputs],
    )


def _layer_arrays(layer: LayerOperators, first: bool) -> Layer:
    plain, basis, knots, tables, bias = (
        tensor.detach().cpu().numpy().astype(np.float32)
        for tensor in (layer.plain, layer.basis, layer.knots, layer.coefficients, layer.bias)
    )
    order = [MEASURED.index(relation) for relation in GROUPED]
    plain, basis, bias = (_padded(part) for part in (plain, basis[order], bias))
    tables = tables[order]
    of_kinds = [_rows(plain, kind, first) for kind in KINDS] if first else [_rows(plain, NodeKind.ROOM, first)]
    matrices = [_rows(basis[place], _source_kind(relation), first) for place, relation in enumerate(GROUPED)]
    rank, _, outputs = matrices[0].shape
    if tables.shape[1] == rank and (tables == np.eye(rank)).all():
        tables = tables[:, :, :0]
    return Layer(
        np.concatenate(of_kinds).reshape(-1, outputs),
        np.concatenate(matrices).reshape(-1, outputs),
        rank,
        knots[order],
        tables,
        bias,
    )


def _shape(layer: Layer, same_tables: bool, first: bool) -> tuple[int, ...]:
    inputs = len(layer.measured) // (NUM_GROUPED * layer.rank)
    kinds = NUM_KINDS if first else 1
    return kinds, inputs, len(layer.bias), layer.rank, *layer.tables.shape[1:], same_tables


def _padded(array: NDArray[np.float32]) -> Float32Array:
    return np.pad(array, [(0, 0)] * (array.ndim - 1) + [(0, -array.shape[-1] % LANES)])


def _rows(matrices: Float32Array, kind: NodeKind, first: bool) -> Float32Array:
    """Matrices (n, in, out) with the rows of a kind's features in the first layer, else with rows padded to `LANES`."""
    if not first:
        return np.pad(matrices, ((0, 0), (0, -matrices.shape[1] % LANES), (0, 0)))
    rows = matrices[:, list(FEATURES[KINDS.index(kind)])]
    return np.pad(rows, ((0, 0), (0, NUM_PACKED - rows.shape[1]), (0, 0)))


def _source_kind(relation: Relation) -> NodeKind:
    if relation in _SOURCE_KINDS:
        return _SOURCE_KINDS[relation]
    return KINDS[1 + MANY_TO_ONE.index(relation)] if relation in MANY_TO_ONE else NodeKind.ROOM


def _same_tables(layers: list[Layer], index: int) -> bool:
    if index == 0:
        return False
    before, layer = layers[index - 1], layers[index]
    return np.array_equal(before.knots, layer.knots) and np.array_equal(before.tables, layer.tables)
