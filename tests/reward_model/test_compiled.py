from functools import cache

import pytest
import torch

from reward_model.compiled import EdgelessMPNN, propagate
from reward_model.graph import scene_graph
from reward_model.models.edge_networks import EDGE_NETWORKS, LayerOperators
from reward_model.windows import pack_windows
from tests.reward_model.random_scenes import random_windows

SIZES = ((42, 2), (42, 8, 2), (42, 8, 6, 5, 2))  # the number of layers decides which frames are reached


def random_network(sizes, edge_network: str, seed: int = 0) -> EdgelessMPNN:
    torch.manual_seed(seed)
    network = EdgelessMPNN(sizes, edge_network).eval()
    for name, parameter in network.named_parameters():
        if name.endswith("tables"):
            torch.nn.init.normal_(parameter, std=0.3)  # a fresh table is the same at all lengths
    torch.nn.init.constant_(network.layers[-1].bias, 1.0)  # random networks would often answer 0
    return network


@cache
def random_operators(sizes, edge_network: str) -> list[LayerOperators]:
    with torch.no_grad():
        return random_network(sizes, edge_network).operators()


@pytest.mark.parametrize("edge_network", sorted(EDGE_NETWORKS))
@pytest.mark.parametrize("sizes", SIZES)
def test_answers_are_those_on_dgl(sizes, edge_network):
    pytest.importorskip("dgl")
    from reward_model.models.batching import dgl_graph
    from reward_model.models.mpnn import MPNN

    windows = random_windows(len(sizes), count=9)
    original = MPNN(sizes, edge_network).eval()
    original.load_state_dict(random_network(sizes, edge_network).state_dict())
    with torch.no_grad():
        answers = torch.relu(propagate(pack_windows(windows), random_operators(sizes, edge_network)))
        expected = original(dgl_graph([scene_graph(window) for window in windows]))
    assert len(set(expected[:, 0].tolist())) == 9
    torch.testing.assert_close(answers, expected, atol=1e-5, rtol=1e-5)


def test_gradients_are_those_on_dgl():
    pytest.importorskip("dgl")
    from reward_model.models.batching import dgl_graph
    from reward_model.models.mpnn import MPNN

    windows = random_windows(7, count=4)
    network = random_network((42, 8, 6, 4, 2), "tabulated")
    original = MPNN((42, 8, 6, 4, 2), "tabulated")
    original.load_state_dict(network.state_dict())
    (torch.relu(network(pack_windows(windows))) ** 2).sum().backward()
    (original(dgl_graph([scene_graph(window) for window in windows])) ** 2).sum().backward()
    expected = dict(original.named_parameters())
    for name, parameter in network.named_parameters():
        assert expected[name].grad.abs().max() > 0, name
        torch.testing.assert_close(parameter.grad, expected[name].grad, atol=1e-5, rtol=1e-4)


@pytest.mark.parametrize("edge_network", sorted(EDGE_NETWORKS))
def test_a_batch_equals_its_singles(edge_network):
    windows = random_windows(11, count=9)
    operators = random_operators(SIZES[-1], edge_network)
    with torch.no_grad():
        batch = propagate(pack_windows(windows), operators)
        singles = torch.cat([propagate(pack_windows([window]), operators) for window in windows])
        reverse = propagate(pack_windows(windows[::-1]), operators).flip(0)
    torch.testing.assert_close(batch, singles, atol=1e-5, rtol=0)
    torch.testing.assert_close(batch, reverse, atol=1e-5, rtol=0)


def test_parameters_are_named_as_on_dgl():
    pytest.importorskip("dgl")
    from reward_model.models.mpnn import MPNN

    for edge_network in EDGE_NETWORKS:
        shapes, expected = (
            {name: tensor.shape for name, tensor in kind((42, 8, 2), edge_network).state_dict().items()}
            for kind in (EdgelessMPNN, MPNN)
        )
        assert shapes == expected
