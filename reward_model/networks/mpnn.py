"""The paper's message-passing network (Gilmer et al. 2017) on DGL's `NNConv`."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import dgl
from dgl.nn.pytorch import NNConv
from torch import Tensor, nn
from torch.nn import functional

from reward_model.networks.edge_networks import EDGE_NETWORKS
from reward_model.networks.graph_network import GraphNetwork


class MPNN(GraphNetwork):
    """NNConv layers with mean aggregation, ELU between them, ReLU at the end.

    Args:
        sizes: features of the nodes, of each hidden layer, and the two scores, e.g. (42, 40, 30, 21, 12, 3, 2)
        edge_network: `perceptron` as published, or `tabulated`
    """

    def __init__(self, sizes: Sequence[int], edge_network: str = "perceptron") -> None:
        super().__init__()
        make = EDGE_NETWORKS[edge_network]
        self.layers = nn.ModuleList(
            NNConv(inputs, outputs, make(inputs, outputs), aggregator_type="mean")
            for inputs, outputs in pairwise(sizes)
        )

    def node_answers(self, graph: dgl.DGLGraph) -> Tensor:
        """(num_nodes, 2), see `GraphNetwork`."""
        hidden = graph.ndata["features"]
        for layer in self.layers[:-1]:
            hidden = functional.elu(layer(graph, hidden, graph.edata["features"]))
        answers: Tensor = self.layers[-1](graph, hidden, graph.edata["features"])
        return answers
