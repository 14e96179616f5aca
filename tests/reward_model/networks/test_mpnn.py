import numpy as np
import pytest
import torch

from reward_model.graph.features import Relation
from reward_model.graph.windows import scene_graph
from reward_model.networks.edge_networks import EDGE_NETWORKS, MEASURED, PLAIN
from tests.reward_model.random_scenes import random_windows

pytest.importorskip("dgl")

from reward_model.networks.batching import dgl_graph
from reward_model.networks.mpnn import MPNN

SIZES = (42, 10, 6, 2)


@pytest.fixture(params=sorted(EDGE_NETWORKS))
def network(request):
    torch.manual_seed(3)
    network = MPNN(SIZES, request.param).eval()
    torch.nn.init.constant_(network.layers[-1].bias, 1.0)  # random networks would often answer 0
    return network


def graphs():
    return [scene_graph(window) for window in random_windows(0)]


def test_a_batch_equals_its_singles(network):
    with torch.no_grad():
        batch = network(dgl_graph(graphs()))
        singles = torch.cat([network(dgl_graph([graph])) for graph in graphs()])
    assert batch.shape == (6, 2)
    assert len(set(batch[:, 0].tolist())) == 6
    torch.testing.assert_close(batch, singles, atol=1e-6, rtol=0)


def test_the_order_of_nodes_and_edges_says_nothing(network):
    graph = graphs()[2]
    rng = np.random.default_rng(0)
    nodes = np.concatenate([[0], 1 + rng.permutation(len(graph.features) - 1)])  # the output node stays first
    edges = rng.permutation(len(graph.sources))
    place = np.argsort(nodes).astype(np.int32)
    shuffled = type(graph)(
        graph.features[nodes],
        place[graph.sources][edges],
        place[graph.targets][edges],
        graph.relations[edges],
        graph.lengths[edges],
    )
    with torch.no_grad():
        torch.testing.assert_close(network(dgl_graph([shuffled])), network(dgl_graph([graph])), atol=1e-6, rtol=0)


def test_one_layer_by_hand():
    """A room hears the mean of what its neighbours and itself say, through the matrices of their relations."""
    network = MPNN((42, 2), "tabulated").eval()
    edge_network = network.layers[0].edge_func
    torch.nn.init.constant_(edge_network.plain, 0.0)
    torch.nn.init.constant_(edge_network.tables, 0.0)
    with torch.no_grad():
        edge_network.tables[MEASURED.index(Relation.GOAL_ROOM), :, 4, 0] = 0.15  # reads the goal's type flag
        edge_network.plain[PLAIN.index(Relation.SELF), 2, 1] = 50.0  # the room's own type flag
        network.layers[0].bias[:] = torch.tensor([0.25, -0.5])
    graph = scene_graph(random_windows(1, count=1)[0])
    heard = int((graph.targets == 0).sum())
    with torch.no_grad():
        scores = network(dgl_graph([graph]))[0].tolist()
    assert scores == pytest.approx([0.15 * 20 / heard + 0.25, 50 / heard - 0.5])


def test_batches_mark_each_newest_room():
    batch = dgl_graph(graphs())
    sizes = [len(graph.features) for graph in graphs()]
    assert batch.ndata["is_output"].nonzero().flatten().tolist() == np.cumsum([0, *sizes[:-1]]).tolist()
    assert batch.edata["features"].shape == (batch.num_edges(), 18)
