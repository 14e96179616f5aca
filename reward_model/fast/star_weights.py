"""From a checkpoint of a star network to the arrays of `reward_model.fast.star_layers`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from torch import nn

from reward_model.base.arrays import Float32Array, FloatArray
from reward_model.fast import star_layers as at
from reward_model.fast.matmul import LANES
from reward_model.fast.star_layers import StarArrays
from reward_model.graph.facts import FACTS, TrainingRange
from reward_model.graph.star import KINDS, WIDTHS
from reward_model.networks.star import (
    CONTACT_DISTANCES,
    CONTACT_SCORE,
    LEAST_TOTAL,
    LIMIT,
    MOST_ATTENTION,
    SUM_SCALE,
    StarNetwork,
    row_widths,
)

_INPUTS = (*KINDS, "rooms")
_MOST_COLUMNS = max(map(sum, WIDTHS.values()))


def star_arrays(network: StarNetwork, rounds: tuple[int, ...], known: TrainingRange | None = None) -> StarArrays:
    """The arrays of a network whose rounds have these sizes, and of its training's range where it is known."""
    tensors = {name: tensor.double().numpy() for name, tensor in network.state_dict().items()}
    weights = _Weights()
    members = [_member(_Folded(tensors, f"members.{index}."), rounds) for index in range(len(network.members))]
    matrices = [[weights.add(matrix) for matrix in member] for member in members]
    inputs = np.zeros((len(_INPUTS), 2, _MOST_COLUMNS), dtype=np.float32)
    for place, name in enumerate(_INPUTS):
        mean, deviation = tensors[f"inputs.{name}.mean"], tensors[f"inputs.{name}.deviation"]
        inputs[place, 0, : len(mean)], inputs[place, 1, : len(mean)] = mean, 1 / deviation
    return StarArrays(
        weights=np.concatenate(weights.parts),
        matrices=np.array(matrices, dtype=np.int64),
        inputs=inputs,
        num_rounds=len(rounds),
        widest=int(np.array(matrices)[..., 2].max()),
        widest_row=max(rounds) + -max(rounds) % LANES,
        contact=np.array(CONTACT_DISTANCES, dtype=np.float32),
        facts=np.array([[-np.inf], [np.inf]]).repeat(len(FACTS), axis=1) if known is None else np.array(known.bounds),
        limits=np.array([LIMIT, SUM_SCALE, MOST_ATTENTION, LEAST_TOTAL, CONTACT_SCORE], dtype=np.float32),
    )


Matrix = FloatArray


@dataclass
class _Weights:
    """Matrices one after the other, each filled up to a multiple of `LANES` columns."""

    parts: list[Float32Array] = field(default_factory=list)
    _size: int = 0

    def add(self, matrix: Matrix) -> tuple[int, int, int]:
        """Append a matrix, and return its start, rows and columns."""
        padded = np.pad(matrix, ((0, 0), (0, -matrix.shape[1] % LANES))).astype(np.float32)
        start, self._size = self._size, self._size + padded.size
        self.parts.append(padded.ravel())
        return start, *padded.shape


@dataclass(frozen=True)
class _Folded:
    """A member's matrices, (in, out), with its batch normalisations folded in.

    Attributes:
        tensors: of the whole network
        prefix: of the member's names
    """

    tensors: Mapping[str, FloatArray]
    prefix: str

    def matrix(self, name: str, norm: str = "") -> Matrix:
        """A linear map's matrix."""
        matrix = self.tensors[f"{self.prefix}{name}.weight"].T
        return matrix * self._factor(norm) if norm else matrix

    def bias(self, name: str, norm: str = "") -> Matrix:
        """A linear map's bias as a row."""
        bias = self.tensors[f"{self.prefix}{name}.bias"]
        if norm:
            mean, shift = (self.tensors[f"{self.prefix}{norm}.{part}"] for part in ("running_mean", "bias"))
            bias = (bias - mean) * self._factor(norm) + shift
        return bias[None]

    def _factor(self, norm: str) -> FloatArray:
        gain, variance = (self.tensors[f"{self.prefix}{norm}.{part}"] for part in ("weight", "running_var"))
        return gain / np.sqrt(variance + nn.BatchNorm1d(1).eps)


def _member(folded: _Folded, rounds: tuple[int, ...]) -> list[Matrix]:
    """The matrices in the order of `star_layers`, with rows filled up where inputs are hidden features."""
    matrices: list[Matrix] = []
    for kind in KINDS:
        encoder = f"encoders.{kind}"
        norm, second = f"{encoder}.norm", f"{encoder}.layer"
        matrices += [
            folded.bias(f"{encoder}.own.even", norm),
            *(folded.matrix(f"{encoder}.{part}", norm) for part in ("own.even", "own.odd", "room.even", "room.odd")),
            folded.bias(f"{second}.linear", f"{second}.norm"),
            _with_rows(folded.matrix(f"{second}.linear", f"{second}.norm"), [row_widths(rounds[0])[kind]]),
        ]
    matrices += [folded.matrix(f"own.{part}", "rooms.0.norm") for part in ("even", "odd")]
    matrices += [
        folded.bias("last.linear", "last.norm"),
        _with_rows(folded.matrix("last.linear", "last.norm"), [2 * rounds[-1]]),
        folded.bias("scores"),
        _with_rows(folded.matrix("scores"), [rounds[-1]]),
    ]
    for number in range(len(rounds)):
        matrices += _round(folded, rounds, number)
    assert len(matrices) == at.FIRST_ROUND + at.PER_ROUND * len(rounds)
    return matrices


def _round(folded: _Folded, rounds: tuple[int, ...], number: int) -> list[Matrix]:
    widths, layer = row_widths(rounds[number]), f"rooms.{number}"
    before = 2 * rounds[number - 1] if number else 0
    matrix = folded.matrix(f"{layer}.linear", f"{layer}.norm")
    pooled = np.split(matrix[before:], np.cumsum([2 * widths[kind] for kind in KINDS])[:-1])
    nothing: Matrix = np.zeros((1, 1))
    matrices = [
        folded.bias(f"{layer}.linear", f"{layer}.norm"),
        _with_rows(matrix[:before], [before]) if number else nothing,
        *(_with_rows(part, [widths[kind]] * 2) for kind, part in zip(KINDS, pooled, strict=True)),
        *(_with_rows(folded.matrix(f"attention.{number}.{kind}"), [widths[kind]]) for kind in KINDS),
        *(folded.bias(f"attention.{number}.{kind}") for kind in KINDS),
    ]
    if not number:
        return [*matrices, *[nothing] * 12]
    contexts = {kind: f"contexts.{number - 1}.{kind}" for kind in KINDS}
    earlier = row_widths(rounds[number - 1])
    return [
        *matrices,
        *(folded.bias(f"{each}.layer.linear", f"{each}.layer.norm") for each in contexts.values()),
        *(_with_rows(folded.matrix(f"{each}.room", f"{each}.layer.norm"), [before]) for each in contexts.values()),
        *(
            _with_rows(folded.matrix(f"{each}.layer.linear", f"{each}.layer.norm"), [earlier[kind]])
            for kind, each in contexts.items()
        ),
    ]


def _with_rows(matrix: Matrix, parts: list[int]) -> Matrix:
    """The matrix with rows of zeros behind each part of its rows, up to a multiple of `LANES`."""
    pieces = np.split(matrix, np.cumsum(parts)[:-1])
    return np.concatenate([np.pad(piece, ((0, -len(piece) % LANES), (0, 0))) for piece in pieces])
