"""The MPNN without its edges: the same answers as on DGL, at a small part of the cost.

An edge network sees a relation and a length, so the matrix of a relation is a curve in the length,
W(d) = sum_k c_k(d) B_k (`LayerOperators`). What all nodes say to the room is therefore
sum_k (sum_j c_k(d_j) h_j) B_k, a sum over nodes before one product, and what the room says to all of them is
sum_k c_k(d_j) (h_room B_k), one product before the sum. Self and temporal edges have one matrix each. The last
layers are computed only in the frames from which the newest room node can still be reached.

It is plain PyTorch: gradients flow, and it runs wherever its tensors are. DGL is not needed.
"""

from __future__ import annotations

from collections.abc import Sequence as Items
from itertools import pairwise
from typing import Final

import torch
from torch import Tensor, nn
from torch.nn import functional

from reward_model.graph import FROM_ROOM, NUM_FRAMES, TO_ROOM, NodeKind, Relation
from reward_model.models.edge_networks import (
    EDGE_NETWORKS,
    MEASURED,
    PLAIN,
    EdgeNetwork,
    LayerOperators,
    interpolate,
)
from reward_model.windows import LINK_RELATIONS, WindowBatch

_ROOM_KINDS: Final = (NodeKind.PERSON, NodeKind.OBJECT, NodeKind.WALL, NodeKind.GOAL)
_INTO_ROOM: Final = [MEASURED.index(Relation(TO_ROOM[kind])) for kind in _ROOM_KINDS]
_OUT_OF_ROOM: Final = [MEASURED.index(Relation(FROM_ROOM[kind])) for kind in _ROOM_KINDS]
_LINKS: Final = [MEASURED.index(relation) for relation in LINK_RELATIONS]
_TO_OLDER: Final = [PLAIN.index(Relation.NOW_TO_SECOND), PLAIN.index(Relation.SECOND_TO_THIRD)]
_TO_NEWER: Final = [PLAIN.index(Relation.SECOND_TO_NOW), PLAIN.index(Relation.THIRD_TO_SECOND)]
_SELF: Final = PLAIN.index(Relation.SELF)


class EdgelessMPNN(nn.Module):
    """An MPNN with the parameters of `reward_model.models.mpnn.MPNN`, by name and shape, computed without edges.

    It can be trained where its edge network can be (`tabulated`); a network with the paper's perceptrons is
    turned into operators once, without gradients.
    """

    def __init__(self, sizes: Items[int], edge_network: str) -> None:
        super().__init__()
        make = EDGE_NETWORKS[edge_network]
        self.layers = nn.ModuleList(_Layer(make(inputs, outputs), outputs) for inputs, outputs in pairwise(sizes))

    def operators(self) -> list[LayerOperators]:
        """What `propagate` needs, layer by layer."""
        return [layer.edge_func.operators(layer.bias) for layer in self.layers]  # type: ignore[operator, union-attr]

    def forward(self, batch: WindowBatch) -> Tensor:
        """(batch, 2) scores before the final ReLU; gradients reach the parameters of tabulated edge networks."""
        return propagate(batch, self.operators())


class _Layer(nn.Module):
    """The parameters of one NNConv, under its names."""

    def __init__(self, edge_func: EdgeNetwork, out_features: int) -> None:
        super().__init__()
        self.edge_func = edge_func
        self.bias = nn.Parameter(torch.zeros(out_features))


def propagate(batch: WindowBatch, layers: Items[LayerOperators]) -> Tensor:
    """Run the network up to its final ReLU: (batch, 2)."""
    hidden = batch.features
    for index, layer in enumerate(layers[:-1]):
        frames = min(NUM_FRAMES, len(layers) - index)
        hidden = functional.elu(_all_nodes(batch, layer, hidden, frames))
    return _newest_room(batch, layers[-1], hidden)


def _all_nodes(batch: WindowBatch, layer: LayerOperators, hidden: Tensor, frames: int) -> Tensor:
    """One layer in the newest frames: (batch, num_frames, num_slots, in) -> (batch, frames, num_slots, out)."""
    seen = hidden[:, :frames]
    out = seen @ layer.plain[_SELF]
    out = out + _from_room(batch, layer, seen)
    out = out + functional.pad(_to_room(batch, layer, seen).unsqueeze(2), (0, 0, 0, seen.shape[2] - 1))
    out = _add_temporal(batch, layer, hidden, out)
    out = _add_links(batch, layer, seen, out)
    return out / batch.degrees[:, :frames].unsqueeze(3) + layer.bias


def _newest_room(batch: WindowBatch, layer: LayerOperators, hidden: Tensor) -> Tensor:
    """The last layer, for its only node that is read: (batch, out)."""
    out = hidden[:, 0, 0] @ layer.plain[_SELF]
    out = out + _to_room(batch, layer, hidden[:, :1])[:, 0]
    if hidden.shape[1] > 1:
        out = out + (batch.together[:, 0, :1] * hidden[:, 1, 0]) @ layer.plain[_TO_NEWER[0]]
    return out / batch.degrees[:, 0, :1] + layer.bias


def _to_room(batch: WindowBatch, layer: LayerOperators, hidden: Tensor) -> Tensor:
    """What every node says to its frame's room: (batch, frames, out)."""
    weights = _room_weights(batch, layer, _INTO_ROOM, hidden.shape[1])  # (batch, frames, slots, kinds * rank)
    heard = (weights.transpose(2, 3) @ hidden).flatten(2)  # (batch, frames, kinds * rank * in)
    return heard @ layer.basis[_INTO_ROOM].flatten(0, 2)


def _from_room(batch: WindowBatch, layer: LayerOperators, hidden: Tensor) -> Tensor:
    """What each frame's room says to every node: (batch, frames, num_slots, out)."""
    weights = _room_weights(batch, layer, _OUT_OF_ROOM, hidden.shape[1])
    basis = layer.basis[_OUT_OF_ROOM].flatten(0, 1)  # (kinds * rank, in, out)
    said = torch.einsum("bfi,kio->bfko", hidden[:, :, 0], basis)
    return weights @ said


def _room_weights(batch: WindowBatch, layer: LayerOperators, relations: list[int], frames: int) -> Tensor:
    """c_k of every room edge, in the columns of its node's kind: (batch, frames, num_slots, kinds * rank)."""
    lengths = batch.lengths[:, :frames]
    columns = []
    for kind, relation in zip(_ROOM_KINDS, relations, strict=True):
        weights = interpolate(layer.coefficients[relation], (lengths / layer.steps[relation]).flatten())
        of_kind = (batch.kinds[:, :frames] == kind).unsqueeze(3)
        columns.append(weights.view(*lengths.shape, -1) * of_kind)
    return torch.cat(columns, dim=3)


def _add_temporal(batch: WindowBatch, layer: LayerOperators, hidden: Tensor, out: Tensor) -> Tensor:
    """Add what equal slots of neighbouring frames say to each other."""
    frames, seen = out.shape[1], hidden.shape[1]
    pairs = min(seen - 1, frames)  # an output frame hears the next older one where that is known
    if pairs > 0:
        older = hidden[:, 1 : pairs + 1] * batch.together[:, :pairs].unsqueeze(3)
        out = out + functional.pad(older @ layer.plain[_TO_NEWER[:pairs]], (0, 0, 0, 0, 0, frames - pairs))
    if frames > 1:
        newer = hidden[:, : frames - 1] * batch.together[:, : frames - 1].unsqueeze(3)
        out = out + functional.pad(newer @ layer.plain[_TO_OLDER[: frames - 1]], (0, 0, 0, 0, 1, 0))
    return out


def _add_links(batch: WindowBatch, layer: LayerOperators, hidden: Tensor, out: Tensor) -> Tensor:
    """Add interactions and people near walls, edge by edge: they are few."""
    frames, num_slots = hidden.shape[1], hidden.shape[2]
    flat_in, flat_out = hidden.flatten(0, 2), out.flatten(0, 2)
    begin = 0
    for relation, count in zip(_LINKS, batch.link_counts, strict=True):
        if not count:
            continue
        chosen = slice(begin, begin + count)
        begin += count
        sources, targets, lengths = (
            part[chosen] for part in (batch.link_sources, batch.link_targets, batch.link_lengths)
        )
        if frames < NUM_FRAMES:
            sources, targets, lengths = _within(frames, num_slots, sources, targets, lengths)
        weights = interpolate(layer.coefficients[relation], lengths / layer.steps[relation])
        messages = (weights.unsqueeze(2) * flat_in[sources].unsqueeze(1)).flatten(1)
        flat_out = flat_out.index_add(0, targets, messages @ layer.basis[relation].flatten(0, 1))
    return flat_out.view_as(out)


def _within(
    frames: int, num_slots: int, sources: Tensor, targets: Tensor, lengths: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """The links of the newest frames, their places counted on the grid of those frames alone."""
    window = NUM_FRAMES * num_slots
    kept = (sources % window) < frames * num_slots
    skipped = (sources[kept] // window) * (NUM_FRAMES - frames) * num_slots
    return sources[kept] - skipped, targets[kept] - skipped, lengths[kept]
