import pytest
import torch

pytest.importorskip("dgl")

from reward_model.networks.batching import dgl_graph
from reward_model.networks.gat import GAT
from tests.reward_model.networks.test_graph_network import graphs


def test_one_gat_layer_by_hand():
    """Without anything to attend to, all neighbours count the same, and heads are averaged."""
    network = GAT((42, 2), num_heads=2)
    layer = network.layers[0]
    graph = graphs()[0]
    with torch.no_grad():
        layer.attn_l.zero_()
        layer.attn_r.zero_()
        layer.fc.weight.zero_()
        layer.fc.weight[0, 4], layer.fc.weight[2, 4] = 1.0, 3.0  # the goal's flag, first output of either head
        layer.bias.zero_()
        scores = network(dgl_graph([graph]))
    assert scores[0].tolist() == pytest.approx([2 / (graph.targets == 0).sum(), 0.0])
