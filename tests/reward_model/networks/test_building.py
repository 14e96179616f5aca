"""From a config to a network, in the form and on the device that are asked for."""

import pytest

from reward_model.networks.building import network_on_dgl, trainable_network, usable_device
from reward_model.networks.checkpoint import Checkpoint, CheckpointError
from reward_model.networks.factorised_mpnn import FactorisedMPNN
from reward_model.networks.registry import NETWORKS, MPNNConfig, Network, network_config
from reward_model.scorer import SocialScorer


@pytest.mark.parametrize("edge_network", ["tabulated", "perceptron"])
def test_an_mpnn_is_trained_without_edges(edge_network):
    assert isinstance(trainable_network(MPNNConfig((42, 2), edge_network), 0), FactorisedMPNN)


@pytest.mark.parametrize("kind", ["rgcn", "gat"])
def test_on_other_devices_only_an_mpnn_has_a_compiled_form(kind):
    checkpoint = Checkpoint(network_config(kind, (42, 6, 2), {}), {})
    message = rf"^the compiled form of {kind} runs on the cpu only, got device 'meta'$"
    with pytest.raises(CheckpointError, match=message):
        SocialScorer(checkpoint, "random", "compiled", "meta")


@pytest.mark.parametrize("kind", ["rgcn", "gat"])
def test_a_device_that_dgl_cannot_use_is_refused(kind):
    """PyTorch knows the device `meta`, DGL does not; so it is with CUDA and DGL's plain wheels."""
    pytest.importorskip("dgl")
    config = network_config(kind, (42, 6, 2), {})
    with pytest.raises(CheckpointError, match=r"^a network on DGL must run on the cpu here, .* device 'meta'$"):
        usable_device(config, "meta")
    with pytest.raises(CheckpointError, match=r"^a network on DGL must run on the cpu here, .* device 'meta'$"):
        SocialScorer(Checkpoint(config, {}), "random", device="meta")
    usable_device(config, "cpu")
    usable_device(MPNNConfig((42, 2), "tabulated"), "meta")


def test_forms_that_a_network_does_not_have(monkeypatch):
    checkpoint = Checkpoint(MPNNConfig((42, 2)), {})
    on_pytorch = Network("MPNN", MPNNConfig, "lengths", "reward_model.networks.factorised_mpnn:FactorisedMPNN")
    monkeypatch.setitem(NETWORKS, "mpnn", on_pytorch)
    with pytest.raises(CheckpointError, match=r"^the network mpnn has no dgl form; form must be 'auto' or 'compiled'$"):
        network_on_dgl(checkpoint.config)
    on_dgl = Network("MPNN", MPNNConfig, "lengths", "reward_model.networks.mpnn:MPNN", on_dgl=True)
    monkeypatch.setitem(NETWORKS, "mpnn", on_dgl)
    with pytest.raises(CheckpointError, match=r"^the compiled form of mpnn does not exist$"):
        SocialScorer(checkpoint, "random", "compiled")
