"""What holds for each kind of network."""

import math

import numpy as np
import pytest
import torch

from reward_model.graph.features import Relation
from reward_model.graph.windows import SceneGraph, scene_graph
from reward_model.networks.checkpoint import (
    Checkpoint,
    CheckpointError,
    NetworkConfig,
    load_checkpoint,
    save_checkpoint,
)
from reward_model.networks.factorised_mpnn import EdgelessMPNN
from reward_model.networks.registry import network_on_dgl, trainable_network, usable_device
from reward_model.scorer import SocialScorer, load_scorer
from tests.reward_model.random_scenes import random_windows

pytest.importorskip("dgl")

from reward_model.networks.batching import dgl_graph
from reward_model.networks.gat import GAT
from reward_model.networks.rgcn import RGCN, relation_shares

CONFIGS = {
    "mpnn": NetworkConfig("mpnn", (42, 8, 6, 2), "perceptron"),
    "rgcn": NetworkConfig("rgcn", (42, 12, 6, 2), num_bases=4),
    "gat": NetworkConfig("gat", (42, 6, 4, 2), num_heads=3, negative_slope=0.2),
}


@pytest.fixture(params=sorted(CONFIGS))
def config(request):
    return CONFIGS[request.param]


def new_network(config: NetworkConfig):
    with torch.random.fork_rng():
        torch.manual_seed(3)
        network = network_on_dgl(config).eval()
    for name, parameter in network.layers[-1].named_parameters():
        if "bias" in name:
            torch.nn.init.constant_(parameter, 1.0)  # random networks would often answer 0
    return network


def graphs() -> list[SceneGraph]:
    return [scene_graph(window) for window in random_windows(0)]


def test_a_batch_equals_its_singles(config):
    network = new_network(config)
    with torch.no_grad():
        batch = network(dgl_graph(graphs()))
        singles = torch.cat([network(dgl_graph([graph])) for graph in graphs()])
    assert batch.shape == (6, 2)
    assert len(set(batch[:, 0].tolist())) == 6
    torch.testing.assert_close(batch, singles, atol=1e-5, rtol=0)


def test_the_order_of_nodes_and_edges_says_nothing(config):
    network, graph = new_network(config), graphs()[2]
    rng = np.random.default_rng(0)
    nodes = np.concatenate([[0], 1 + rng.permutation(len(graph.features) - 1)])  # the output node stays first
    edges = rng.permutation(len(graph.sources))
    place = np.argsort(nodes).astype(np.int32)
    shuffled = SceneGraph(
        graph.features[nodes],
        place[graph.sources][edges],
        place[graph.targets][edges],
        graph.relations[edges],
        graph.lengths[edges],
    )
    with torch.no_grad():
        torch.testing.assert_close(network(dgl_graph([shuffled])), network(dgl_graph([graph])), atol=1e-5, rtol=0)


def test_a_few_graphs_are_learned_by_heart(config):
    network = new_network(config).train()
    batch = dgl_graph(graphs())
    scores = torch.from_numpy(np.random.default_rng(1).uniform(0.1, 0.9, (6, 2)).astype(np.float32))
    optimizer = torch.optim.Adam(network.parameters(), lr=1e-2)
    errors = []
    for _ in range(80):
        loss = ((network.node_answers(batch)[batch.ndata["is_output"]] - scores) ** 2).mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        errors.append(loss.item())
    assert errors[0] > 0.05
    assert errors[-1] < 0.005


def test_a_node_without_neighbours_is_finite(config):
    alone = SceneGraph(
        np.zeros((2, 42), dtype=np.float32),
        np.array([0, 1], dtype=np.int32),
        np.array([0, 1], dtype=np.int32),
        np.full(2, Relation.SELF, dtype=np.int32),
        np.zeros(2, dtype=np.float32),
    )
    with torch.no_grad():
        assert torch.isfinite(new_network(config).node_answers(dgl_graph([alone]))).all()


def test_answers_are_scores_before_the_last_relu(config):
    network, windows = new_network(config), random_windows(0)
    with torch.no_grad():
        answers = network.answers(windows)
        torch.testing.assert_close(torch.relu(answers), network(dgl_graph(graphs())))


def test_checkpoints_of_each_kind_score_as_the_network_does(config, tmp_path):
    network, windows = new_network(config), random_windows(0)
    save_checkpoint(tmp_path / "mine", Checkpoint(config, network.state_dict()))
    assert load_checkpoint(tmp_path / "mine").config == config
    with torch.no_grad():
        expected = network(dgl_graph(graphs())).numpy()
    np.testing.assert_allclose(load_scorer(tmp_path / "mine").score_windows(windows), expected, atol=1e-4)
    np.testing.assert_allclose(load_scorer(tmp_path / "mine", "dgl").score_windows(windows), expected, atol=1e-5)


@pytest.mark.parametrize("kind", ["rgcn", "gat"])
def test_on_other_devices_only_an_mpnn_has_a_compiled_form(kind):
    checkpoint = Checkpoint(CONFIGS[kind], new_network(CONFIGS[kind]).state_dict())
    message = rf"^the compiled form of {kind} runs on the cpu only, got device 'meta'$"
    with pytest.raises(CheckpointError, match=message):
        SocialScorer(checkpoint, "random", "compiled", "meta")


def test_a_seed_says_with_which_weights_training_starts(config):
    before = torch.get_rng_state()
    first, same, other = (trainable_network(config, seed).state_dict() for seed in (1, 1, 2))
    assert torch.equal(torch.get_rng_state(), before)
    assert all(torch.equal(first[name], same[name]) for name in first)
    assert any(not torch.equal(first[name], other[name]) for name in first)


@pytest.mark.parametrize("edge_network", ["tabulated", "perceptron"])
def test_an_mpnn_is_trained_without_edges(edge_network):
    assert isinstance(trainable_network(NetworkConfig("mpnn", (42, 2), edge_network), 0), EdgelessMPNN)


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


@pytest.mark.parametrize("kind", ["rgcn", "gat"])
def test_a_device_that_dgl_cannot_use_is_refused(kind):
    """PyTorch knows the device `meta`, DGL does not; so it is with CUDA and DGL's plain wheels."""
    config = CONFIGS[kind]
    with pytest.raises(CheckpointError, match=r"^a network on DGL must run on the cpu here, .* device 'meta'$"):
        usable_device(config, "meta")
    with pytest.raises(CheckpointError, match=r"^a network on DGL must run on the cpu here, .* device 'meta'$"):
        SocialScorer(Checkpoint(config, new_network(config).state_dict()), "random", device="meta")
    usable_device(config, "cpu")
    usable_device(NetworkConfig("mpnn", (42, 2), "tabulated"), "meta")


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


def test_dropout_works_in_training_only():
    for config in (
        NetworkConfig("rgcn", (42, 12, 6, 2), num_bases=4, dropout=0.5),
        NetworkConfig("gat", (42, 6, 4, 2), num_heads=3, negative_slope=0.2, dropout=0.5),
    ):
        network, windows = network_on_dgl(config), random_windows(0)
        with torch.no_grad():
            assert not torch.equal(network.train().answers(windows), network.answers(windows))
            assert torch.equal(network.eval().answers(windows), network.answers(windows))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"kind": "mpnn", "edge_network": "perceptron", "num_bases": 3}, "num_bases is no option of mpnn, which takes"),
        ({"kind": "rgcn", "num_bases": 3, "num_heads": 3}, "num_heads is no option of rgcn, which takes"),
        ({"kind": "rgcn"}, "num_bases must be at least 1, got 0"),
        ({"kind": "gat", "num_heads": 2, "negative_slope": -1.0}, "negative_slope must lie in 0..1, 1 excluded, got"),
        ({"kind": "gat", "num_heads": 2, "dropout": math.nan}, "dropout must lie in 0..1, 1 excluded, got nan"),
    ],
)
def test_impossible_configs(values, message):
    with pytest.raises(CheckpointError, match=f"^{message}"):
        NetworkConfig(sizes=(42, 2), **values)
