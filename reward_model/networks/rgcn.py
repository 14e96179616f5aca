"""The relational graph convolutional network (Schlichtkrull et al. 2018) on DGL's `RelGraphConv`."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import dgl
import torch
from dgl.nn.pytorch import RelGraphConv
from torch import Tensor, nn
from torch.nn import functional

from reward_model.graph.features import NUM_RELATIONS
from reward_model.networks.graph_network import GraphNetwork


class RGCN(GraphNetwork):
    """One matrix a relation, mixed from a few bases; ELU between the layers, ReLU at the end.

    It sees an edge's relation, not its length. Messages of one relation are averaged over who sends them (the
    c_i,r of Schlichtkrull et al.), or the dozens of wall segments in a room would drown its people. The graph has
    self edges as a relation of its own, so the layers add none.

    Args:
        sizes: features of the nodes, of each hidden layer, and the two scores
        num_bases: matrices that the 18 relations' are mixed from; a layer has no more than there are relations
        dropout: of each hidden layer's output while training
    """

    def __init__(self, sizes: Sequence[int], num_bases: int, dropout: float = 0.0) -> None:
        super().__init__()
        bases = min(num_bases, NUM_RELATIONS)  # the paper draws up to 24; more than relations add nothing
        self.layers = nn.ModuleList(
            RelGraphConv(inputs, outputs, NUM_RELATIONS, regularizer="basis", num_bases=bases, self_loop=False)
            for inputs, outputs in pairwise(sizes)
        )
        self.dropout = nn.Dropout(dropout)

    def node_answers(self, graph: dgl.DGLGraph) -> Tensor:
        """(num_nodes, 2), see `GraphNetwork`."""
        sources, targets = (ends.long() for ends in graph.edges())
        relations = graph.edata["relation"]
        order = torch.argsort(relations, stable=True)
        counts = torch.bincount(relations, minlength=NUM_RELATIONS).tolist()
        edges = _Edges(sources[order], targets[order], relation_shares(targets, relations)[order], counts)
        hidden = graph.ndata["features"]
        for layer in self.layers[:-1]:
            hidden = self.dropout(functional.elu(propagated(layer, hidden, edges)))
        return propagated(self.layers[-1], hidden, edges)


class _Edges(NamedTuple):
    """Edges sorted by relation: node indices, each one's share (num_edges, 1), and how many there are of each."""

    sources: Tensor
    targets: Tensor
    shares: Tensor
    counts: list[int]


def propagated(layer: RelGraphConv, hidden: Tensor, edges: _Edges) -> Tensor:
    """(num_nodes, out) what the layer answers; DGL's own product of edges by relation takes many times as long."""
    heard = torch.split(hidden[edges.sources] * edges.shares, edges.counts)
    said = [part @ matrix for part, matrix in zip(heard, layer.linear_r.get_weight(), strict=True)]
    answers: Tensor = layer.h_bias.repeat(len(hidden), 1).index_add(0, edges.targets, torch.cat(said))
    return answers


def relation_shares(targets: Tensor, relations: Tensor) -> Tensor:
    """(num_edges, 1) one over the number of edges of the same relation into the same node."""
    groups = targets.long() * NUM_RELATIONS + relations
    return 1 / torch.bincount(groups)[groups].unsqueeze(1).float()
