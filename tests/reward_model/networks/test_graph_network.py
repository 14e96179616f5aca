"""What holds for each kind of network on DGL."""

import numpy as np
import pytest
import torch

from reward_model.graph.features import Relation
from reward_model.graph.windows import SceneGraph, scene_graph
from reward_model.networks.building import network_on_dgl
from reward_model.networks.checkpoint import Checkpoint, load_checkpoint, save_checkpoint
from reward_model.networks.registry import GATConfig, MPNNConfig, NetworkConfig, RGCNConfig
from reward_model.scorer import load_scorer
from tests.reward_model.random_scenes import random_windows

pytest.importorskip("dgl")

from reward_model.networks.batching import dgl_graph

CONFIGS = {
    "mpnn": MPNNConfig((42, 8, 6, 2), "perceptron"),
    "rgcn": RGCNConfig((42, 12, 6, 2), num_bases=4),
    "gat": GATConfig((42, 6, 4, 2), num_heads=3, negative_slope=0.2),
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


def test_dropout_works_in_training_only():
    for config in (
        RGCNConfig((42, 12, 6, 2), num_bases=4, dropout=0.5),
        GATConfig((42, 6, 4, 2), num_heads=3, negative_slope=0.2, dropout=0.5),
    ):
        network, windows = network_on_dgl(config), random_windows(0)
        with torch.no_grad():
            assert not torch.equal(network.train().answers(windows), network.answers(windows))
            assert torch.equal(network.eval().answers(windows), network.answers(windows))
