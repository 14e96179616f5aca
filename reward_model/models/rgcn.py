"""The relational graph convolutional network (Schlichtkrull et al. 2018) on DGL's `RelGraphConv`."""

from __future__ import annotations

from collections.abc import Sequence as Items
from itertools import pairwise

import dgl
import torch
from dgl.nn.pytorch import RelGraphConv
from torch import Tensor, nn
from torch.nn import functional

from reward_model.graph import NUM_RELATIONS
from reward_model.models.graph_network import GraphNetwork


class RGCN(GraphNetwork):
    """One matrix a relation, mixed from a few bases; ELU between the layers, ReLU at the end.

    It sees an edge's relation, not its length. Messages of one relation are averaged over who sends them (the
    c_i,r of Schlichtkrull et al.), or the dozens of wall segments in a room would drown its people. The graph has
    self edges as a relation of its own, so the layers add none.

    sizes: features of the nodes, of each hidden layer, and the two scores
    num_bases: matrices that the 18 relations' are mixed from; a layer has no more than there are relations
    dropout: of each hidden layer's output while training
    """

    def __init__(self, sizes: Items[int], num_bases: int, dropout: float = 0.0) -> None:
        super().__init__()
        bases = min(num_bases, NUM_RELATIONS)  # the paper draws up to 24; more than relations add nothing
        self.layers = nn.ModuleList(
            RelGraphConv(inputs, outputs, NUM_RELATIONS, regularizer="basis", num_bases=bases, self_loop=False)
            for inputs, outputs in pairwise(sizes)
        )
        self.dropout = nn.Dropout(dropout)

    def node_answers(self, graph: dgl.DGLGraph) -> Tensor:
        """(num_nodes, 2), see `GraphNetwork`."""
        relations = graph.edata["relation"]
        shares = relation_shares(graph.edges()[1], relations)
        hidden = graph.ndata["features"]
        for layer in self.layers[:-1]:
            hidden = self.dropout(functional.elu(layer(graph, hidden, relations, shares)))
        answers: Tensor = self.layers[-1](graph, hidden, relations, shares)
        return answers


def relation_shares(targets: Tensor, relations: Tensor) -> Tensor:
    """(num_edges, 1) one over the number of edges of the same relation into the same node."""
    groups = targets.long() * NUM_RELATIONS + relations
    return 1 / torch.bincount(groups)[groups].unsqueeze(1).float()
