"""The graph attention network (Velickovic et al. 2018) on DGL's `GATConv`."""

from __future__ import annotations

from collections.abc import Sequence

import dgl
from dgl.nn.pytorch import GATConv
from torch import Tensor, nn
from torch.nn import functional

from reward_model.networks.graph_network import GraphNetwork


class GAT(GraphNetwork):
    """Attention over neighbours with several heads; ELU between the layers, ReLU at the end.

    It sees who is joined to whom, neither relation nor length. The heads of a hidden layer stand side by side,
    those of the last one are averaged, as in Velickovic et al.

    Args:
        sizes: features of the nodes, of each head of each hidden layer, and the two scores
        num_heads: of every layer
        negative_slope: of the attention's leaky ReLU, the paper's alpha
        dropout: of each layer's input and of the attention while training
    """

    def __init__(self, sizes: Sequence[int], num_heads: int, negative_slope: float = 0.2, dropout: float = 0.0) -> None:
        super().__init__()
        inputs = [sizes[0], *(num_heads * size for size in sizes[1:-1])]
        self.layers = nn.ModuleList(
            GATConv(
                width,
                outputs,
                num_heads,
                feat_drop=dropout,
                attn_drop=dropout,
                negative_slope=negative_slope,
                residual=False,
            )
            for width, outputs in zip(inputs, sizes[1:], strict=True)
        )

    def node_answers(self, graph: dgl.DGLGraph) -> Tensor:
        """(num_nodes, 2), see `GraphNetwork`."""
        hidden = graph.ndata["features"]
        for layer in self.layers[:-1]:
            hidden = functional.elu(layer(graph, hidden)).flatten(1)
        answers: Tensor = self.layers[-1](graph, hidden).mean(dim=1)
        return answers
