import pytest
import torch

from reward_model.networks.edge_networks import PerceptronEdgeNetwork
from reward_model.networks.operator_cache import kept_operators
from tests.reward_model.networks.test_factorised_mpnn import SIZES, random_network, random_operators


@pytest.fixture
def network():
    return random_network(SIZES[1], "perceptron", seed=1)


class Maker:
    """Makes operators and counts how often."""

    def __init__(self):
        self.calls = 0

    def __call__(self):
        self.calls += 1
        return random_operators(SIZES[1], "perceptron")


def parts(operators):
    return [tensor for layer in operators for tensor in vars(layer).values()]


def test_operators_are_made_once_and_read_again(tmp_path, network):
    make = Maker()
    path = tmp_path / "operators.safetensors"
    made = kept_operators(path, network.state_dict(), make)
    read = kept_operators(path, network.state_dict(), make)
    assert make.calls == 1
    assert len(read) == 2
    for tensor, expected in zip(parts(read), parts(made), strict=True):
        assert torch.equal(tensor, expected)
    assert [each.name for each in tmp_path.iterdir()] == ["operators.safetensors"]


def test_other_weights_and_other_settings_have_other_operators(tmp_path, monkeypatch, network):
    make = Maker()
    path = tmp_path / "operators.safetensors"
    kept_operators(path, network.state_dict(), make)
    with torch.no_grad():
        network.layers[0].bias[0] += 1e-6
    kept_operators(path, network.state_dict(), make)
    assert make.calls == 2
    monkeypatch.setattr(PerceptronEdgeNetwork, "RANK", 3)
    kept_operators(path, network.state_dict(), make)
    assert make.calls == 3
    kept_operators(path, network.state_dict(), make)
    assert make.calls == 3


@pytest.mark.parametrize("content", [b"", b"text", b"\x08\0\0\0\0\0\0\0{}      "])
def test_a_damaged_file_is_replaced(tmp_path, network, content):
    make = Maker()
    path = tmp_path / "operators.safetensors"
    path.write_bytes(content)
    kept_operators(path, network.state_dict(), make)
    kept_operators(path, network.state_dict(), make)
    assert make.calls == 1


def test_a_place_that_cannot_be_written_is_done_without(tmp_path, network):
    make = Maker()
    (tmp_path / "file").write_text("")
    operators = kept_operators(tmp_path / "file" / "operators.safetensors", network.state_dict(), make)
    assert make.calls == 1
    assert len(operators) == 2
