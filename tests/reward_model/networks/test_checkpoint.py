import json

import pytest
import torch
from safetensors.torch import save

from reward_model.networks.checkpoint import Checkpoint, CheckpointError, load_checkpoint, save_checkpoint
from reward_model.networks.factorised_mpnn import FactorisedMPNN
from reward_model.networks.registry import NETWORKS, MPNNConfig

CONFIG = MPNNConfig((42, 4, 2), "tabulated")
DOCUMENT = {
    "graph_layout": "socnav2-graph-1",
    "network": {"kind": "mpnn", "sizes": [42, 4, 2], "edge_network": "tabulated"},
    "about": {"source": "made by hand"},
}


def some_checkpoint(seed: int = 0, **about) -> Checkpoint:
    torch.manual_seed(seed)
    return Checkpoint(CONFIG, FactorisedMPNN(CONFIG.sizes, CONFIG.edge_network).state_dict(), about)


@pytest.fixture
def folder(tmp_path):
    save_checkpoint(tmp_path / "trained", some_checkpoint(source="made by hand"))
    return tmp_path / "trained"


def files_of(path):
    return {file.name: file.read_bytes() for file in path.iterdir()}


def refusal(folder) -> str:
    """The one line that says why a checkpoint cannot be loaded."""
    with pytest.raises(CheckpointError) as caught:
        load_checkpoint(folder)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_what_was_saved_is_loaded(folder):
    loaded, saved = load_checkpoint(folder), some_checkpoint()
    assert loaded.config == CONFIG
    assert loaded.about == {"source": "made by hand"}
    assert loaded.tensors.keys() == saved.tensors.keys()
    for name, tensor in saved.tensors.items():
        assert torch.equal(loaded.tensors[name], tensor)


def test_the_files_are_safetensors_and_json(folder):
    assert sorted(files_of(folder)) == ["config.json", "model.safetensors"]
    assert json.loads((folder / "config.json").read_text()) == DOCUMENT


def test_transposed_tensors_are_saved(tmp_path):
    tensor = torch.arange(6.0).reshape(2, 3).T
    save_checkpoint(tmp_path / "trained", Checkpoint(CONFIG, {"weight": tensor}))
    assert torch.equal(load_checkpoint(tmp_path / "trained").tensors["weight"], tensor)


def test_saving_replaces_an_older_checkpoint(folder):
    save_checkpoint(folder, some_checkpoint(1))
    assert load_checkpoint(folder).about == {}
    assert torch.equal(load_checkpoint(folder).tensors["layers.0.bias"], some_checkpoint(1).tensors["layers.0.bias"])
    assert sorted(file.name for file in folder.parent.iterdir()) == ["trained"]


def test_a_value_that_json_cannot_hold_leaves_the_older_checkpoint(folder):
    before = files_of(folder)
    with pytest.raises(TypeError):
        save_checkpoint(folder, some_checkpoint(1, source=object()))
    assert files_of(folder) == before


@pytest.mark.parametrize("full_at", [0, 1])
def test_a_full_disk_leaves_the_older_checkpoint_and_nothing_else(folder, monkeypatch, full_at):
    from reward_model.networks import checkpoint

    written, replace_file = [], checkpoint.replace_file

    def until_full(path, content):
        if len(written) == full_at:
            raise OSError("no space left")
        written.append(path)
        replace_file(path, content)

    before = files_of(folder)
    monkeypatch.setattr(checkpoint, "replace_file", until_full)
    for place in (folder, folder.parent / "another"):
        written.clear()
        with pytest.raises(OSError, match="no space left"):
            save_checkpoint(place, some_checkpoint(1))
    assert files_of(folder) == before
    assert [file.name for file in folder.parent.iterdir()] == ["trained"]


@pytest.mark.parametrize("name", ["config.json", "model.safetensors"])
def test_missing_files(folder, name):
    (folder / name).unlink()
    assert refusal(folder) == (
        f"{folder}: a checkpoint folder must hold config.json and model.safetensors, {name} is missing"
    )


def changed(**values):
    return DOCUMENT | values


def with_network(**values):
    return changed(network=DOCUMENT["network"] | values)


def rgcn(**values):
    return changed(network={"kind": "rgcn", "sizes": [42, 4, 2], "num_bases": 4, "dropout": 0.0} | values)


@pytest.mark.parametrize(
    ("document", "reason"),
    [
        ([], "must be an object with the keys ['about', 'graph_layout', 'network']"),
        ({"network": {}}, "must be an object with the keys ['about', 'graph_layout', 'network']"),
        (changed(more=1), "must be an object with the keys ['about', 'graph_layout', 'network']"),
        (changed(graph_layout="socnav2-graph-0"), "graph_layout must be 'socnav2-graph-1', got 'socnav2-graph-0'; "),
        (changed(graph_layout=None), "graph_layout must be 'socnav2-graph-1', got None; "),
        (changed(network=3), f"network must be an object whose kind is one of {sorted(NETWORKS)}"),
        (with_network(heads=3), "network must be an object with the keys ['edge_network', 'kind', 'sizes']"),
        (with_network(kind=3), f"network must be an object whose kind is one of {sorted(NETWORKS)}"),
        (with_network(kind="gan"), f"network kind must be one of {sorted(NETWORKS)}, got 'gan'"),
        (with_network(edge_network="deep"), "edge_network must be one of ['perceptron', 'tabulated'], got 'deep'"),
        (with_network(kind="gat"), "network must be an object with the keys ['dropout', 'kind', 'negative_slope', "),
        (rgcn(num_bases=0), "num_bases must be at least 1, got 0"),
        (rgcn(num_bases=2.5), "network.num_bases must be a int, got 2.5"),
        (rgcn(dropout=1.0), "dropout must lie in 0..1, 1 excluded, got 1.0"),
        (with_network(sizes="42"), "network.sizes must be a list, got '42'"),
        (with_network(sizes=[42, 0, 2]), "network.sizes must be positive whole numbers, got [42, 0, 2]"),
        (with_network(sizes=[42, True, 2]), "network.sizes must be positive whole numbers, got [42, True, 2]"),
        (with_network(sizes=[42, 4.0, 2]), "network.sizes must be positive whole numbers, got [42, 4.0, 2]"),
        (with_network(sizes=[41, 4, 2]), "sizes must run from 42 to 2, got [41, 4, 2]"),
        (with_network(sizes=[42]), "sizes must run from 42 to 2, got [42]"),
        (with_network(sizes=[]), "sizes must run from 42 to 2, got []"),
    ],
)
def test_unusable_configs(folder, document, reason):
    (folder / "config.json").write_text(json.dumps(document))
    assert refusal(folder).startswith(f"{folder / 'config.json'}: {reason}")


@pytest.mark.parametrize("content", [b"", b"{", b'{"about": ', b"\xff\xfe\x00", b"[" * 100_000])
def test_broken_json(folder, content):
    (folder / "config.json").write_bytes(content)
    assert refusal(folder).startswith(f"{folder / 'config.json'}: not readable as JSON (")


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"\x80\x04\x95", b"\xff" * 64])
def test_broken_weights(folder, content):
    (folder / "model.safetensors").write_bytes(content)
    assert refusal(folder).startswith(f"{folder / 'model.safetensors'}: not a readable safetensors file (")


def test_truncated_weights(folder):
    content = (folder / "model.safetensors").read_bytes()
    (folder / "model.safetensors").write_bytes(content[:-100])
    assert "model.safetensors: not a readable safetensors file (" in refusal(folder)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_weights_that_are_not_finite(folder, value):
    tensors = some_checkpoint().tensors
    tensors["layers.1.bias"][1] = value
    (folder / "model.safetensors").write_bytes(save(tensors))
    assert refusal(folder) == f"{folder / 'model.safetensors'}: layers.1.bias must hold finite numbers only"
