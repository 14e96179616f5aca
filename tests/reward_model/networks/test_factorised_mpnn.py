from functools import cache

import pytest
import torch

from reward_model.graph.windows import scene_graph
from reward_model.networks.edge_networks import EDGE_NETWORKS, LayerOperators
from reward_model.networks.factorised_mpnn import FactorisedMPNN, propagate
from reward_model.networks.padded_windows import pack_windows
from tests.reward_model.random_scenes import random_windows

SIZES = ((42, 2), (42, 8, 2), (42, 8, 6, 5, 2))  # the number of layers decides which frames are reached


def random_network(sizes, edge_network: str, seed: int = 0) -> FactorisedMPNN:
    torch.manual_seed(seed)
    network = FactorisedMPNN(sizes, edge_network).eval()
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
    from reward_model.networks.batching import dgl_graph
    from reward_model.networks.mpnn import MPNN

    windows = random_windows(len(sizes), count=9)
    original = MPNN(sizes, edge_network).eval()
    original.load_state_dict(random_network(sizes, edge_network).state_dict())
    with torch.no_grad():
        answers = torch.relu(propagate(pack_windows(windows), random_operators(sizes, edge_network)))
        expected = original(dgl_graph([scene_graph(window) for window in windows]))
    assert len(set(expected[:, 0].tolist())) == 9
    torch.testing.assert_close(answers, expected, atol=1e-5, rtol=1e-5)


# A perceptron's curve is taken to be straight between the lengths at which it is evaluated.
@pytest.mark.parametrize(("edge_network", "tolerance"), [("tabulated", 1e-5), ("perceptron", 1e-2)])
def test_losses_and_gradients_are_those_on_dgl(edge_network, tolerance):
    pytest.importorskip("dgl")
    from reward_model.networks.batching import dgl_graph
    from reward_model.networks.mpnn import MPNN

    windows = random_windows(7, count=4)
    network = random_network((42, 8, 6, 4, 2), edge_network).train()
    original = MPNN((42, 8, 6, 4, 2), edge_network)
    original.load_state_dict(network.state_dict())
    loss = (torch.relu(network(pack_windows(windows))) ** 2).mean()
    expected_loss = (original(dgl_graph([scene_graph(window) for window in windows])) ** 2).mean()
    loss.backward()
    expected_loss.backward()
    torch.testing.assert_close(loss, expected_loss, atol=1e-4, rtol=0)
    gradients, expected = (
        torch.cat([parameter.grad.flatten() for _, parameter in sorted(each.named_parameters())])
        for each in (network, original)
    )
    assert all(parameter.grad.abs().max() > 0 for parameter in original.parameters())
    assert (gradients - expected).norm() < tolerance * expected.norm()


def test_windows_of_one_frame_need_no_more():
    """The grid has as many frames as the longest window; empty ones change nothing."""
    windows = [window[:1] for window in random_windows(3, count=5)]
    longer = [*windows, random_windows(4, count=1)[0]]
    assert len(pack_windows(windows).features) == 1
    for sizes in SIZES:
        operators = random_operators(sizes, "tabulated")
        alone, beside = propagate(pack_windows(windows), operators), propagate(pack_windows(longer), operators)
        torch.testing.assert_close(alone, beside[:5], atol=1e-5, rtol=1e-5)


def test_a_perceptron_is_evaluated_at_more_lengths_outside_training():
    windows = random_windows(5, count=6)
    network = random_network((42, 8, 2), "perceptron")
    with torch.no_grad():
        exact = propagate(pack_windows(windows), network.operators())
        fine = network.eval().answers(windows)
        coarse = network.train().answers(windows)
    assert (fine - exact).abs().max() < 1e-4
    assert 0 < (fine - exact).abs().max() <= (coarse - exact).abs().max() < 1e-2


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
    from reward_model.networks.mpnn import MPNN

    for edge_network in EDGE_NETWORKS:
        shapes, expected = (
            {name: tensor.shape for name, tensor in kind((42, 8, 2), edge_network).state_dict().items()}
            for kind in (FactorisedMPNN, MPNN)
        )
        assert shapes == expected
