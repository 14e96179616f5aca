"""Edge networks of the MPNN: what turns an edge's features into the matrix its message is multiplied with.

An edge's 18 features say two things only: its relation and its length. So each relation's matrix is a curve in
the length, and `operators` returns those curves in the factorised form that `factorised_mpnn` computes with.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Protocol

import torch
from torch import Tensor, nn

from reward_model.graph.features import FROM_ROOM, LENGTH_FEATURE, NUM_EDGE_FEATURES, NUM_RELATIONS, TO_ROOM, Relation

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

    Attributes:
        plain: (5, in, out) one matrix for each of `PLAIN`
        basis: (13, rank, in, out) for each of `MEASURED`
        knots: (13, num_knots) [dam or m, as the relation's lengths are] ascending from 0
        coefficients: (13, num_knots, rank) at the knots; the matrix of a relation at length d is sum_k c_k(d) basis_k
            with c linear between its knots (and beyond the last one)
        bias: (out,)
    """

    plain: Tensor
    basis: Tensor
    knots: Tensor
    coefficients: Tensor
    bias: Tensor

    def to(self, device: torch.device | str) -> LayerOperators:
        """The same operators on another device."""
        parts = (self.plain, self.basis, self.knots, self.coefficients, self.bias)
        return LayerOperators(*(part.to(device) for part in parts))


class EdgeNetwork(Protocol):
    """Anything that gives each edge its matrix, edge by edge or as operators for a whole layer."""

    def __call__(self, edge_features: Tensor) -> Tensor:
        """(num_edges, 18) -> (num_edges, in * out)."""
        ...

    def operators(self, bias: Tensor) -> LayerOperators:
        """The same matrices, for all edges at once, without gradients where they have to be computed."""
        ...

    def training_operators(self, bias: Tensor, finely: bool = False) -> LayerOperators:
        """The same as functions of the parameters, so that gradients reach them. finely: at more lengths."""
        ...


class PerceptronEdgeNetwork(nn.Sequential):
    """The paper's edge network: two hidden layers between the edge's features and the matrix.

    Hidden sizes follow the published code: two thirds and one third of the way between input and output.
    """

    # What `operators` keeps of a curve: so many singular directions, or one for so many numbers that a matrix has. On
    # the published weights scores then move by less than 5e-5; with 32 in the first layer, too, by up to 2e-4.
    RANK: Final = 32
    NUMBERS: Final = 40
    NUM_LENGTHS: Final = 257  # at which they are sought
    # Lengths at which a curve is evaluated in training, and to tell how good a network is; it is taken to be straight
    # in between. The published network's answers then are off by 0.005 and by less than 0.001 (root mean square).
    TRAINING_KNOTS: Final = 33
    EVALUATION_KNOTS: Final = 129

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
        """Follow each relation's curve from bend to bend and keep its leading singular directions, by an SVD."""
        shape = (-1, self.in_features, self.out_features)
        plain = self(_edge_features(PLAIN, torch.zeros(1))).reshape(shape)
        size = self.in_features * self.out_features
        rank = min(max(self.RANK, size // self.NUMBERS), size)
        knots = _padded([self._bends(relation) for relation in MEASURED])
        bases, coefficients = [], []
        for relation, lengths in zip(MEASURED, knots, strict=True):
            curve = self(_edge_features((relation,), torch.linspace(0, _reach(relation), self.NUM_LENGTHS)))
            directions = torch.linalg.svd(curve, full_matrices=False).Vh[:rank]
            bases.append(directions.reshape(shape))
            coefficients.append(self(_edge_features((relation,), lengths)) @ directions.T)
        return LayerOperators(plain, torch.stack(bases), knots, torch.stack(coefficients), bias.detach())

    def _bends(self, relation: Relation) -> Tensor:
        """(n,) the lengths between 0 and the relation's reach at which its curve bends, and these two ends.

        The network is linear in the length but where one of its hidden units comes in or goes out.
        """
        reach = _reach(relation)
        first, second, _ = (copy.deepcopy(layer).double() for layer in self if isinstance(layer, nn.Linear))
        at_zero = first(_edge_features((relation,), torch.zeros(1)).double())[0]
        bends = -at_zero / first.weight[:, LENGTH_FEATURE]
        ends = torch.tensor([0.0, reach], dtype=torch.float64)
        lengths = torch.cat([ends, bends[(bends > 0) & (bends < reach)]]).sort().values
        units = second(torch.relu(first(_edge_features((relation,), lengths).double())))
        before, after = units[:-1], units[1:]
        place, unit = torch.nonzero((before > 0) != (after > 0), as_tuple=True)
        share = before[place, unit] / (before[place, unit] - after[place, unit])
        more = torch.lerp(lengths[place], lengths[place + 1], share)
        lengths = torch.cat([lengths, more]).sort().values
        apart = torch.cat([torch.ones(1, dtype=torch.bool), lengths.diff() > _CLOSEST * reach])
        return lengths[apart]

    def training_operators(self, bias: Tensor, finely: bool = False) -> LayerOperators:
        """Evaluate each relation's curve at as many lengths, however many edges there are."""
        count = self.EVALUATION_KNOTS if finely else self.TRAINING_KNOTS
        knots = torch.stack([torch.linspace(0, _reach(relation), count) for relation in MEASURED])
        curves = [_edge_features((relation,), lengths) for relation, lengths in zip(MEASURED, knots, strict=True)]
        features = torch.cat([_edge_features(PLAIN, torch.zeros(1)), *curves]).to(bias.device)
        matrices = self(features).reshape(-1, self.in_features, self.out_features)
        basis = matrices[len(PLAIN) :].reshape(len(MEASURED), count, self.in_features, self.out_features)
        coefficients = torch.eye(count, device=bias.device).expand(len(MEASURED), -1, -1)
        return LayerOperators(matrices[: len(PLAIN)], basis, knots.to(bias.device), coefficients, bias)


class TabulatedEdgeNetwork(nn.Module):
    """Our edge network: each relation's matrix at a few lengths is a parameter, linear in between.

    The perceptron can learn any such curve too, at hundreds of times the cost. Knots lie closer together where
    nearness matters.
    """

    KNOTS: Final = (0.0, 0.05, 0.1, 0.15, 0.25, 0.4, 0.7, 1.2)  # dam from robot or person
    WALL_SCALE: Final = 10 / 8  # knots of person-wall edges are these times as far, in m: 1.5 at most
    # The room averages over all nodes, most of them wall segments. The few others' messages start out larger:
    # that halves the training error after as many epochs.
    GAINS: Final = MappingProxyType({Relation.PERSON_ROOM: 5.0, Relation.OBJECT_ROOM: 5.0, Relation.GOAL_ROOM: 20.0})

    def __init__(self, in_features: int, out_features: int) -> None:
        super().__init__()
        self.in_features, self.out_features = in_features, out_features
        scale = (2 / in_features) ** 0.5
        shape = (in_features, out_features)
        self.plain = nn.Parameter(scale * torch.randn(len(PLAIN), *shape))
        self.tables = nn.Parameter(scale * torch.randn(len(MEASURED), 1, *shape).repeat(1, len(self.KNOTS), 1, 1))
        knots = torch.tensor(self.KNOTS).repeat(len(MEASURED), 1)
        knots[[MEASURED.index(relation) for relation in IN_METRES]] *= self.WALL_SCALE
        self.register_buffer("knots", knots, persistent=False)
        coefficients = torch.eye(len(self.KNOTS)).repeat(len(MEASURED), 1, 1)
        self.register_buffer("coefficients", coefficients, persistent=False)
        gains = torch.tensor([self.GAINS.get(relation, 1.0) for relation in MEASURED])
        self.register_buffer("gains", gains.view(-1, 1, 1, 1), persistent=False)
        self.gains: Tensor
        self.knots: Tensor
        self.coefficients: Tensor

    def operators(self, bias: Tensor) -> LayerOperators:
        """The parameters themselves, so that gradients reach them."""
        return LayerOperators(self.plain, self.gains * self.tables, self.knots, self.coefficients, bias)

    def training_operators(self, bias: Tensor, finely: bool = False) -> LayerOperators:
        """The same: there is nothing between the knots."""
        return self.operators(bias)

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
            weights = interpolate(self.knots[index], self.coefficients[index], lengths)
            matrices[chosen] = weights @ (self.gains[index] * self.tables[index]).flatten(1)
        return matrices


EDGE_NETWORKS: Final[dict[str, type[PerceptronEdgeNetwork] | type[TabulatedEdgeNetwork]]] = {
    "perceptron": PerceptronEdgeNetwork,
    "tabulated": TabulatedEdgeNetwork,
}

_CLOSEST = 1e-5  # shares of a relation's reach: of two bends closer together one is kept


def _reach(relation: Relation) -> float:
    """Return the longest length for which a relation's curve is followed from bend to bend."""
    if relation in IN_METRES:
        return 1.5  # m, no person-wall edge is longer
    room_edge = relation in TO_ROOM or relation in FROM_ROOM
    return 2.0 if room_edge else 0.8  # dam


def interpolate(knots: Tensor, table: Tensor, lengths: Tensor) -> Tensor:
    """Read a table at any lengths: linear between its knots and on beyond its ends.

    Args:
        knots: (num_knots,) ascending
        table: (num_knots, width)
        lengths: of any shape

    Returns:
        (*shape, width).
    """
    row = (torch.searchsorted(knots, lengths.detach(), right=True) - 1).clamp(0, len(knots) - 2)
    share = ((lengths - knots[row]) / (knots[row + 1] - knots[row])).unsqueeze(-1)
    return table[row] * (1 - share) + table[row + 1] * share


def _padded(knots: list[Tensor]) -> Tensor:
    """(num_relations, num_knots) float32: those that have fewer go on, evenly, up to twice their reach."""
    longest = max(map(len, knots))
    rows = [torch.cat([row, torch.linspace(1, 2, longest - len(row) + 1)[1:] * row[-1]]) for row in knots]
    return torch.stack(rows).float()


def _edge_features(relations: tuple[Relation, ...], lengths: Tensor) -> Tensor:
    """(len(relations) * len(lengths), 18) every relation at every length."""
    features = torch.zeros(len(relations), len(lengths), NUM_EDGE_FEATURES)
    for index, relation in enumerate(relations):
        features[index, :, relation] = 1
    features[:, :, LENGTH_FEATURE] = lengths
    return features.flatten(0, 1)


assert len(MEASURED) + len(PLAIN) == NUM_RELATIONS
