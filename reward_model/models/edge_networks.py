"""Edge networks of the MPNN: what turns an edge's features into the matrix its message is multiplied with.

An edge's 18 features say two things only: its relation and its length. So each relation's matrix is a curve in
the length, and `operators` returns those curves in the factorised form that `reward_model.compiled` computes with.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Protocol

import torch
from torch import Tensor, nn

from reward_model.graph import (
    FROM_ROOM,
    LENGTH_FEATURE,
    NUM_EDGE_FEATURES,
    NUM_RELATIONS,
    TO_ROOM,
    Relation,
)

# Relations whose edges have a length, in the order of the tables; the others have one matrix each.
MEASURED: Final = tuple(r for r in Relation if r < Relation.SELF or r in (Relation.WALL_PERSON, Relation.WALL_ROOM))
PLAIN: Final = (
    Relation.SELF,
    Relation.NOW_TO_SECOND,
    Relation.SECOND_TO_NOW,
    Relation.SECOND_TO_THIRD,
    Relation.THIRD_TO_SECOND,
)
IN_METRES: Final = (Relation.PERSON_WALL, Relation.WALL_PERSON)


@dataclass(frozen=True, eq=False)
class LayerOperators:
    """One layer's matrices as functions of relation and length.

    plain: (5, in, out) one matrix for each of `PLAIN`
    basis: (13, rank, in, out) for each of `MEASURED`
    coefficients: (13, num_lengths, rank) at lengths step apart from 0; the matrix of a relation at length d is
        sum_k c_k(d) basis_k with c interpolated linearly (and extrapolated beyond the last length)
    steps: (13,) [dam or m, as the relation's lengths are]
    bias: (out,)
    """

    plain: Tensor
    basis: Tensor
    coefficients: Tensor
    steps: Tensor
    bias: Tensor

    def to(self, device: torch.device | str) -> LayerOperators:
        """The same operators on another device."""
        parts = (self.plain, self.basis, self.coefficients, self.steps, self.bias)
        return LayerOperators(*(part.to(device) for part in parts))


class EdgeNetwork(Protocol):
    """Anything that gives each edge its matrix, edge by edge or as operators for a whole layer."""

    def __call__(self, edge_features: Tensor) -> Tensor:
        """(num_edges, 18) -> (num_edges, in * out)."""
        ...

    def operators(self, bias: Tensor) -> LayerOperators:
        """The same matrices, for all edges at once."""
        ...


class PerceptronEdgeNetwork(nn.Sequential):
    """The paper's edge network: two hidden layers between the edge's features and the matrix.

    Hidden sizes follow the published code: two thirds and one third of the way between input and output.
    """

    # What `operators` keeps of the curves. On the published weights scores then move by less than 3e-5.
    RANK: Final = 32  # singular directions
    COARSE: Final = 4  # every so many of the sampled lengths, the directions are sought in

    def __init__(self, in_features: int, out_features: int) -> None:
        self.in_features, self.out_features = in_features, out_features
        size = in_features * out_features
        first = int(NUM_EDGE_FEATURES * 0.666 + size * 0.334)
        second = int(NUM_EDGE_FEATURES * 0.334 + size * 0.666)
        super().__init__(
            nn.Linear(NUM_EDGE_FEATURES, first),
            nn.ReLU(),
            nn.Linear(first, second),
            nn.ReLU(),
            nn.Linear(second, size),
        )

    @torch.no_grad()
    def operators(self, bias: Tensor) -> LayerOperators:
        """Sample each relation's curve and keep its leading singular directions (SVD over the length)."""
        shape = (-1, self.in_features, self.out_features)
        plain = self(_edge_features(PLAIN, torch.zeros(1))).reshape(shape)
        rank = min(self.RANK, self.in_features * self.out_features)
        bases, coefficients = [], []
        for relation in MEASURED:
            lengths = torch.linspace(0, _reach(relation), _NUM_LENGTHS)
            curve = self(_edge_features((relation,), lengths))
            directions = torch.linalg.svd(curve[:: self.COARSE], full_matrices=False).Vh[:rank]
            bases.append(directions.reshape(shape))
            coefficients.append(curve @ directions.T)
        steps = torch.tensor([_reach(relation) / (_NUM_LENGTHS - 1) for relation in MEASURED])
        return LayerOperators(plain, torch.stack(bases), torch.stack(coefficients), steps, bias.detach())


class TabulatedEdgeNetwork(nn.Module):
    """Our edge network: each relation's matrix at a few lengths is a parameter, linear in between.

    The perceptron can learn any such curve too, at hundreds of times the cost. Knots lie closer together where
    nearness matters.
    """

    KNOTS: Final = (0.0, 0.05, 0.1, 0.15, 0.25, 0.4, 0.7, 1.2)  # dam from robot or person
    WALL_SCALE: Final = 10 / 8  # knots of person-wall edges are these times as far, in m: 1.5 at most
    # What the room hears is a mean over all nodes, most of them wall segments. The few others speak up, or they
    # would take long to be heard: half the training error after as many epochs.
    GAINS: Final = MappingProxyType({Relation.PERSON_ROOM: 5.0, Relation.OBJECT_ROOM: 5.0, Relation.GOAL_ROOM: 20.0})

    def __init__(self, in_features: int, out_features: int) -> None:
        super().__init__()
        self.in_features, self.out_features = in_features, out_features
        scale = (2 / in_features) ** 0.5
        shape = (in_features, out_features)
        self.plain = nn.Parameter(scale * torch.randn(len(PLAIN), *shape))
        self.tables = nn.Parameter(scale * torch.randn(len(MEASURED), 1, *shape).repeat(1, len(self.KNOTS), 1, 1))
        coefficients = _hat_functions(torch.tensor(self.KNOTS))
        self.register_buffer("coefficients", coefficients.expand(len(MEASURED), -1, -1), persistent=False)
        steps = torch.full((len(MEASURED),), _KNOT_STEP)
        steps[[MEASURED.index(relation) for relation in IN_METRES]] *= self.WALL_SCALE
        self.register_buffer("steps", steps, persistent=False)
        gains = torch.tensor([self.GAINS.get(relation, 1.0) for relation in MEASURED])
        self.register_buffer("gains", gains.view(-1, 1, 1, 1), persistent=False)
        self.gains: Tensor
        self.coefficients: Tensor
        self.steps: Tensor

    def operators(self, bias: Tensor) -> LayerOperators:
        """The parameters themselves, so that gradients reach them."""
        return LayerOperators(self.plain, self.gains * self.tables, self.coefficients, self.steps, bias)

    def forward(self, edge_features: Tensor) -> Tensor:
        """(num_edges, 18) -> (num_edges, in * out): the tables read edge by edge."""
        flags = edge_features.clone()
        flags[:, LENGTH_FEATURE] = 0.5  # the last relation's flag was overwritten: it is what remains
        relations = flags.argmax(dim=1)
        matrices = edge_features.new_zeros(len(relations), self.in_features * self.out_features)
        for index, relation in enumerate(PLAIN):
            matrices[relations == relation] = self.plain[index].flatten()
        for index, relation in enumerate(MEASURED):
            chosen = relations == relation
            lengths = edge_features[chosen, LENGTH_FEATURE]
            weights = interpolate(self.coefficients[index], lengths / self.steps[index])
            matrices[chosen] = weights @ (self.gains[index] * self.tables[index]).flatten(1)
        return matrices


EDGE_NETWORKS: Final[dict[str, type[PerceptronEdgeNetwork] | type[TabulatedEdgeNetwork]]] = {
    "perceptron": PerceptronEdgeNetwork,
    "tabulated": TabulatedEdgeNetwork,
}

_KNOT_STEP = 0.05  # dam, every knot is a multiple of it
_NUM_LENGTHS = 1025  # where a perceptron's curves are sampled


def _reach(relation: Relation) -> float:
    """Return the longest length at which a relation's curve is sampled; beyond it, it goes on straight."""
    if relation in IN_METRES:
        return 1.5  # m, no person-wall edge is longer
    room_edge = relation in TO_ROOM or relation in FROM_ROOM
    return 2.0 if room_edge else 0.8  # dam


def interpolate(table: Tensor, places: Tensor) -> Tensor:
    """Read a table at fractional rows, linearly, and linearly on beyond its ends.

    table: (num_rows, width); places: (n,) in rows. Returns (n, width).
    """
    row = places.detach().floor().clamp(0, len(table) - 2).long()
    share = (places - row).unsqueeze(1)
    return table[row] * (1 - share) + table[row + 1] * share


def _hat_functions(knots: Tensor) -> Tensor:
    """(num_lengths, num_knots) the piecewise-linear functions that are 1 at one knot and 0 at the others."""
    lengths = torch.arange(round(float(knots[-1]) / _KNOT_STEP) + 1) * _KNOT_STEP
    right = torch.searchsorted(knots, lengths - 1e-6).clamp(1, len(knots) - 1)
    share = (lengths - knots[right - 1]) / (knots[right] - knots[right - 1])
    hats = torch.zeros(len(lengths), len(knots))
    rows = torch.arange(len(lengths))
    hats[rows, right - 1] = 1 - share
    hats[rows, right] = share
    return hats


def _edge_features(relations: tuple[Relation, ...], lengths: Tensor) -> Tensor:
    """(len(relations) * len(lengths), 18) every relation at every length."""
    features = torch.zeros(len(relations), len(lengths), NUM_EDGE_FEATURES)
    for index, relation in enumerate(relations):
        features[index, :, relation] = 1
    features[:, :, LENGTH_FEATURE] = lengths
    return features.flatten(0, 1)


assert len(MEASURED) + len(PLAIN) == NUM_RELATIONS
