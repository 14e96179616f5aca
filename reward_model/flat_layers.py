"""A network's operators as one flat array, which compiled code takes apart again.

Handing arrays to compiled code takes time, array by array, and a network has dozens.
"""

from __future__ import annotations

from collections.abc import Sequence as Items
from typing import Final, NamedTuple

import numpy as np

from reward_model.graph import FROM_ROOM, TO_ROOM, Float32Array, NodeKind, Relation
from reward_model.jit import njit
from reward_model.models.edge_networks import MEASURED, PLAIN, LayerOperators
from reward_model.scenario import IntArray

ROOM_KINDS: Final = (NodeKind.PERSON, NodeKind.OBJECT, NodeKind.WALL, NodeKind.GOAL)
INTO_ROOM: Final = tuple(MEASURED.index(Relation(TO_ROOM[kind])) for kind in ROOM_KINDS)
OUT_OF_ROOM: Final = tuple(MEASURED.index(Relation(FROM_ROOM[kind])) for kind in ROOM_KINDS)
NUM_ROOM_KINDS: Final = len(ROOM_KINDS)


class Layer(NamedTuple):
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


def flat_layers(operators: Items[LayerOperators]) -> tuple[Float32Array, IntArray]:
    """All layers' arrays one after the other, and what `layer_at` needs to find them again, (num_layers, 5)."""
    layers = [_layer_arrays(layer) for layer in operators]
    sizes = [sum(part.size for part in layer) for layer in layers]
    starts = np.cumsum([0, *sizes[:-1]])
    shapes = [(*layer.plain.shape[1:], *layer.coefficients.shape[1:]) for layer in layers]
    weights = np.concatenate([part.ravel() for layer in layers for part in layer])
    return weights, np.column_stack([starts, np.array(shapes)])


@njit
def layer_at(weights: Float32Array, shape: IntArray) -> Layer:
    """Find a layer's arrays again: where it starts, and how many inputs, outputs, lengths and ranks it has."""
    start, inputs, outputs, lengths, rank = shape[0], shape[1], shape[2], shape[3], shape[4]
    num_plain, num_measured = len(PLAIN), len(MEASURED)
    size = inputs * outputs
    into = start + num_plain * size
    out_of = into + NUM_ROOM_KINDS * rank * size
    aggregate = out_of + NUM_ROOM_KINDS * rank * size
    project = aggregate + num_measured * rank * size
    coefficients = project + num_measured * rank * size
    steps = coefficients + num_measured * lengths * rank
    bias = steps + num_measured
    return Layer(
        weights[start:into].reshape(num_plain, inputs, outputs),
        weights[into:out_of].reshape(NUM_ROOM_KINDS * rank * inputs, outputs),
        weights[out_of:aggregate].reshape(inputs, NUM_ROOM_KINDS * rank * outputs),
        weights[aggregate:project].reshape(num_measured, rank * inputs, outputs),
        weights[project:coefficients].reshape(num_measured, inputs, rank * outputs),
        weights[coefficients:steps].reshape(num_measured, lengths, rank),
        weights[steps:bias],
        weights[bias : bias + outputs],
    )


def _layer_arrays(layer: LayerOperators) -> Layer:
    plain, basis, coefficients, steps, bias = (
        np.array(tensor.detach().cpu().numpy(), dtype=np.float32, order="C")  # a copy: training on changes nothing
        for tensor in (layer.plain, layer.basis, layer.coefficients, layer.steps, layer.bias)
    )
    num_measured, rank, inputs, outputs = basis.shape
    by_input = np.ascontiguousarray(basis.transpose(0, 2, 1, 3))  # (13, in, rank, out)
    into_room = basis[list(INTO_ROOM)].reshape(-1, outputs)
    out_of_room = np.ascontiguousarray(by_input[list(OUT_OF_ROOM)].transpose(1, 0, 2, 3)).reshape(inputs, -1)
    aggregate = basis.reshape(num_measured, rank * inputs, outputs)
    project = by_input.reshape(num_measured, inputs, rank * outputs)
    return Layer(plain, into_room, out_of_room, aggregate, project, coefficients, steps, bias)
