import numpy as np
import pytest
import torch

from reward_model.fast.elu import apply_elu
from reward_model.fast.engine import FusedNetwork
from reward_model.fast.relational_kernels import score_by_relation
from reward_model.fast.relational_weights import flat_layers
from reward_model.networks.edge_networks import EDGE_NETWORKS
from reward_model.networks.factorised_mpnn import propagate
from reward_model.networks.padded_windows import pack_windows
from tests.reward_model.networks.test_factorised_mpnn import SIZES, random_network, random_operators
from tests.reward_model.random_scenes import random_windows


def fused_network(operators) -> FusedNetwork:
    return FusedNetwork(flat_layers(operators), score_by_relation)


@pytest.mark.parametrize("edge_network", sorted(EDGE_NETWORKS))
@pytest.mark.parametrize("sizes", SIZES)
def test_scores_are_those_of_the_padded_network(sizes, edge_network):
    windows = random_windows(20 + len(sizes), count=12)
    operators = random_operators(sizes, edge_network)
    fused = fused_network(operators)
    with torch.no_grad():
        expected = torch.relu(propagate(pack_windows(windows), operators)).numpy()
    scores = fused(windows)
    assert scores.dtype == np.float32
    np.testing.assert_allclose(scores, expected, atol=1e-5, rtol=1e-5)


def test_the_same_window_gives_the_same_bits_whatever_came_before():
    windows = random_windows(31, count=20)
    fused = fused_network(random_network((42, 8, 6, 2), "tabulated").operators())
    first = [fused([window]).tobytes() for window in windows]
    second = [row.tobytes() for row in fused(windows[::-1])]
    assert first == second[::-1]
    assert len(set(first)) == 20


@pytest.mark.parametrize("num_threads", [2, 3])
def test_threads_change_nothing(monkeypatch, num_threads):
    windows = random_windows(35, count=13)
    fused = fused_network(random_network((42, 8, 6, 2), "tabulated").operators())
    alone = fused(windows)
    monkeypatch.setattr(torch, "get_num_threads", lambda: num_threads)
    np.testing.assert_array_equal(fused(windows), alone)
    assert len({row.tobytes() for row in alone}) == 13


def test_elu_is_that_of_pytorch():
    values = np.array([[-100, -16.1, -15.9, -3, -1], [-0.5, -1e-3, -1e-7, -0.0, np.nan], [0, 1e-7, 1, 300, np.inf]])
    values = np.concatenate([values.astype(np.float32), np.linspace(-20, 2, 5000, dtype=np.float32).reshape(-1, 5)])
    expected = torch.nn.functional.elu(torch.from_numpy(values.copy())).numpy()
    apply_elu(values)
    np.testing.assert_allclose(values, expected, rtol=1e-6, atol=2e-7)


def test_training_on_changes_nothing():
    network = random_network((42, 8, 2), "tabulated")
    window = random_windows(33, count=1)[0]
    fused = fused_network(network.operators())
    before = fused([window])
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.fill_(0.5)
    np.testing.assert_array_equal(fused([window]), before)


def test_frames_are_left_as_they_were():
    window = random_windows(32, count=3)[2]
    before = [frame.arrays.features.copy() for frame in window]
    fused_network(random_network((42, 8, 2), "tabulated").operators())([window])
    for frame, features in zip(window, before, strict=True):
        np.testing.assert_array_equal(frame.arrays.features, features)
