import pytest
import torch

from reward_model.graph.features import Relation

pytest.importorskip("dgl")

from reward_model.networks.batching import dgl_graph
from reward_model.networks.rgcn import RGCN, relation_shares
from tests.reward_model.networks.test_graph_network import CONFIGS, graphs, new_network


def test_an_rgcn_answers_as_dgls_layers_do():
    network = new_network(CONFIGS["rgcn"])
    graph = dgl_graph(graphs())
    relations = graph.edata["relation"]
    shares = relation_shares(graph.edges()[1], relations)
    hidden = graph.ndata["features"]
    for layer in network.layers[:-1]:
        hidden = torch.nn.functional.elu(layer(graph, hidden, relations, shares))
    expected = network.layers[-1](graph, hidden, relations, shares)
    torch.testing.assert_close(network.node_answers(graph), expected, atol=1e-5, rtol=1e-5)


def test_relations_share_what_a_node_hears():
    """Node 0 hears two walls and one goal, node 1 one wall."""
    targets = torch.tensor([0, 0, 0, 1])
    relations = torch.tensor([13, 13, 0, 13])
    assert relation_shares(targets, relations).flatten().tolist() == [0.5, 0.5, 1.0, 1.0]


def test_one_rgcn_layer_by_hand():
    """Each relation's mean times its matrix; here one base, mixed with 1 for the goal and 2 for walls."""
    network = RGCN((42, 2), num_bases=1)
    linear = network.layers[0].linear_r
    with torch.no_grad():
        linear.W.zero_()
        linear.W[0, 4, 0], linear.W[0, 3, 1] = 1.0, 1.0  # the type flags of goal and wall
        linear.coeff.zero_()
        linear.coeff[Relation.GOAL_ROOM, 0], linear.coeff[Relation.WALL_ROOM, 0] = 1.0, 2.0
        network.layers[0].h_bias[:] = torch.tensor([0.25, -0.5])
        scores = network(dgl_graph(graphs()[:1]))
    assert scores[0].tolist() == pytest.approx([1.25, 1.5])


def test_more_bases_than_relations_are_not_made():
    assert RGCN((42, 2), num_bases=24).layers[0].linear_r.W.shape[0] == 18
