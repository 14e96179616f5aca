"""The MPNN without its edges: the same answers as on DGL, at a small part of the cost.

An edge network sees a relation and a length, so the matrix of a relation is a curve in the length,
W(d) = sum_k c_k(d) B_k (`LayerOperators`). The sum of all nodes' messages to the room is therefore
sum_k (sum_j c_k(d_j) h_j) B_k, a sum over nodes before one product, and the room's message to node j is
sum_k c_k(d_j) (h_room B_k), one product before the sum. Self and temporal edges have one matrix each. The last
layers are computed only in the frames from which the newest room node can still be reached.

It is plain PyTorch: gradients flow, and it runs wherever its tensors are. DGL is not needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Final

import torch
from torch import Tensor, nn
from torch.nn import functional

from reward_model.graph.features import FROM_ROOM, TO_ROOM, NodeKind, Relation
from reward_model.graph.frame import FrameGraph
from reward_model.networks.edge_networks import (
    EDGE_NETWORKS,
    MEASURED,
    PLAIN,
    EdgeNetwork,
    LayerOperators,
    interpolate,
)
from reward_model.networks.operator_cache import kept_operators
from reward_model.networks.padded_windows import LINK_RELATIONS, WindowBatch, pack_windows
from reward_model.networks.window_network import WindowNetwork

_ROOM_KINDS: Final = (NodeKind.PERSON, NodeKind.OBJECT, NodeKind.WALL, NodeKind.GOAL)
_INTO_ROOM: Final = [MEASURED.index(Relation(TO_ROOM[kind])) for kind in _ROOM_KINDS]
_OUT_OF_ROOM: Final = [MEASURED.index(Relation(FROM_ROOM[kind])) for kind in _ROOM_KINDS]
_LINKS: Final = [MEASURED.index(relation) for relation in LINK_RELATIONS]
_TO_OLDER: Final = [PLAIN.index(Relation.NOW_TO_SECOND), PLAIN.index(Relation.SECOND_TO_THIRD)]
_TO_NEWER: Final = [PLAIN.index(Relation.SECOND_TO_NOW), PLAIN.index(Relation.THIRD_TO_SECOND)]
_SELF: Final = PLAIN.index(Relation.SELF)


class FactorisedMPNN(WindowNetwork):
    """An MPNN with the parameters of `reward_model.networks.mpnn.MPNN`, by name and shape, computed without edges.

    With the paper's perceptrons it computes with curves that are straight between the lengths at which they are
    evaluated: at fewer lengths in training.
    """

    def __init__(self, sizes: Sequence[int], edge_network: str) -> None:
        super().__init__()
        make = EDGE_NETWORKS[edge_network]
        self.layers = nn.ModuleList(_Layer(make(inputs, outputs), outputs) for inputs, outputs in pairwise(sizes))

    def operators(self) -> list[LayerOperators]:
        """What `propagate` needs, layer by layer; without gradients for perceptrons."""
        return [layer.edge_func.operators(layer.bias) for layer in self.layers]  # type: ignore[operator, union-attr]

    def forward(self, batch: WindowBatch) -> Tensor:
        """(batch, 2) scores before the final ReLU; gradients reach the parameters."""
        layers: list[LayerOperators] = [
            layer.edge_func.training_operators(layer.bias, not self.training)  # type: ignore[operator, union-attr]
            for layer in self.layers
        ]
        return propagate(batch, layers)

    def answers(self, windows: Sequence[Sequence[FrameGraph]], device: torch.device | str = "cpu") -> Tensor:
        """(num_windows, 2) scores before the final ReLU, what training works on."""
        return self(pack_windows(windows).to(device))  # type: ignore[no-any-return]

    @torch.no_grad()
    def scoring_operators(self, operators_file: Path | None = None) -> list[LayerOperators]:
        """The operators of the final weights, from the file where they are there, else computed and written there."""
        if operators_file is None:
            return self.operators()
        return kept_operators(operators_file, self.state_dict(), self.operators)

    def for_scoring(self, device: torch.device, operators_file: Path | None = None) -> WindowNetwork:
        """The same with the operators computed once, by perceptrons exactly, see `WindowNetwork`."""
        return _ScoringMPNN([layer.to(device) for layer in self.scoring_operators(operators_file)])


class _ScoringMPNN(WindowNetwork):
    def __init__(self, layers: list[LayerOperators]) -> None:
        super().__init__()
        self._layers = layers

    def answers(self, windows: Sequence[Sequence[FrameGraph]], device: torch.device | str = "cpu") -> Tensor:
        """(num_windows, 2) scores before the final ReLU."""
        return propagate(pack_windows(windows).to(device), self._layers)


class _Layer(nn.Module):
    """The parameters of one NNConv, under its names."""

    def __init__(self, edge_func: EdgeNetwork, out_features: int) -> None:
        super().__init__()
        self.edge_func = edge_func
        self.bias = nn.Parameter(torch.zeros(out_features))


def propagate(batch: WindowBatch, layers: Sequence[LayerOperators]) -> Tensor:
    """Run the network up to its final ReLU: (batch, 2)."""
    hidden = batch.features
    weights: _EdgeWeights | None = None
    for index, layer in enumerate(layers):
        if weights is None or not _same_tables(layer, layers[index - 1]):
            weights = _edge_weights(batch, layer)
        if index == len(layers) - 1:
            break
        frames = min(len(hidden), len(layers) - index)
        hidden = functional.elu(_all_nodes(batch, layer, weights, hidden, frames))
    assert weights is not None, "a network has layers"
    return _newest_room(batch, layers[-1], weights, hidden)


@dataclass(frozen=True, eq=False)
class _EdgeWeights:
    """c_k of every edge, for one layer's tables or for several layers that share them.

    Attributes:
        into_room, out_of_room: (num_frames, batch, num_slots, kinds * rank) in the columns of each node's kind
        links: for each of `LINK_RELATIONS`, (num_links, rank)
    """

    into_room: Tensor
    out_of_room: Tensor
    links: list[Tensor]


@torch.no_grad()
def _edge_weights(batch: WindowBatch, layer: LayerOperators) -> _EdgeWeights:
    into_room = _room_weights(batch, layer, _INTO_ROOM)
    links = [
        interpolate(layer.knots[relation], layer.coefficients[relation], lengths)
        for relation, lengths in zip(_LINKS, torch.split(batch.link_lengths, list(batch.link_counts)), strict=True)
    ]
    same = all(torch.equal(each[_INTO_ROOM], each[_OUT_OF_ROOM]) for each in (layer.knots, layer.coefficients))
    return _EdgeWeights(into_room, into_room if same else _room_weights(batch, layer, _OUT_OF_ROOM), links)


def _same_tables(layer: LayerOperators, other: LayerOperators) -> bool:
    return torch.equal(layer.knots, other.knots) and torch.equal(layer.coefficients, other.coefficients)


def _room_weights(batch: WindowBatch, layer: LayerOperators, relations: Sequence[int]) -> Tensor:
    """relations: places in `MEASURED`, one a kind. Returns (num_frames, batch, num_slots, kinds * rank).

    The columns of other kinds than a node's stay empty, all of them for rooms and empty slots.
    """
    parts = [
        interpolate(layer.knots[relation], layer.coefficients[relation], batch.lengths)
        * (batch.kinds == kind).unsqueeze(3)
        for kind, relation in zip(_ROOM_KINDS, relations, strict=True)
    ]
    return torch.cat(parts, dim=3)


def _all_nodes(batch: WindowBatch, layer: LayerOperators, weights: _EdgeWeights, hidden: Tensor, frames: int) -> Tensor:
    """One layer in the newest frames: (num_frames, batch, num_slots, in) -> (frames, batch, num_slots, out)."""
    moments = hidden.unbind(0)
    matrices = layer.plain.unbind(0)
    from_room = _from_room(layer, hidden[:frames])
    parts = []
    for time in range(frames):
        out = torch.baddbmm(moments[time] @ matrices[_SELF], weights.out_of_room[time], from_room[time])
        if time > 0:
            newer = moments[time - 1] @ matrices[_TO_OLDER[time - 1]]
            out = torch.addcmul(out, newer, batch.together[time - 1].unsqueeze(2))
        if time + 1 < len(moments):
            older = moments[time + 1] @ matrices[_TO_NEWER[time]]
            out = torch.addcmul(out, older, batch.together[time].unsqueeze(2))
        parts.append(out)
    out = _add_lists(batch, layer, weights, hidden[:frames], torch.stack(parts))
    return out / batch.degrees[:frames].unsqueeze(3) + layer.bias


def _newest_room(batch: WindowBatch, layer: LayerOperators, weights: _EdgeWeights, hidden: Tensor) -> Tensor:
    """The last layer, for its only node that is read: (batch, out)."""
    out = hidden[0, :, 0] @ layer.plain[_SELF] + _to_room(layer, weights, hidden[:1])[0]
    if len(hidden) > 1:
        out = out + (batch.together[0, :, :1] * hidden[1, :, 0]) @ layer.plain[_TO_NEWER[0]]
    return out / batch.degrees[0, :, :1] + layer.bias


def _to_room(layer: LayerOperators, weights: _EdgeWeights, hidden: Tensor) -> Tensor:
    """The sum of all nodes' messages to their frame's room: (frames, batch, out)."""
    aggregated = (weights.into_room[: len(hidden)].transpose(2, 3) @ hidden).flatten(
        2
    )  # (frames, batch, kinds*rank*in)
    return aggregated @ layer.basis[_INTO_ROOM].flatten(0, 2)


def _from_room(layer: LayerOperators, hidden: Tensor) -> Tensor:
    """The room's messages, before their sum for each node: (frames, batch, kinds * rank, out)."""
    basis = layer.basis[_OUT_OF_ROOM].flatten(0, 1)  # (kinds * rank, in, out)
    return torch.einsum("fbi,kio->fbko", hidden[:, :, 0], basis)


def _add_lists(batch: WindowBatch, layer: LayerOperators, weights: _EdgeWeights, hidden: Tensor, out: Tensor) -> Tensor:
    """Add the messages that only some nodes receive: rooms, and, edge by edge as they are few, along links."""
    flat_in, flat_out = hidden.flatten(0, 2), out.flatten(0, 2)
    num_slots = hidden.shape[2]
    messages = [_to_room(layer, weights, hidden).flatten(0, 1)]
    targets = [torch.arange(0, len(flat_in), num_slots, device=out.device)]
    split = zip(
        _LINKS,
        weights.links,
        torch.split(batch.link_sources, list(batch.link_counts)),
        torch.split(batch.link_targets, list(batch.link_counts)),
        strict=True,
    )
    for relation, link_weights, sources, link_targets in split:
        kept = sources < len(flat_in)  # older frames come last on the grid
        weighted = (link_weights[kept].unsqueeze(2) * flat_in[sources[kept]].unsqueeze(1)).flatten(1)
        messages.append(weighted @ layer.basis[relation].flatten(0, 1))
        targets.append(link_targets[kept])
    return flat_out.index_add(0, torch.cat(targets), torch.cat(messages)).view_as(out)
