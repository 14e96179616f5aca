"""Trained networks on disk: a folder with `model.safetensors` and `config.json`. Nothing is ever unpickled."""

from __future__ import annotations

import json
import tempfile
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save
from torch import Tensor

from reward_model.files import replace_file
from reward_model.graph import LAYOUT_VERSION, NUM_NODE_FEATURES

WEIGHTS_FILE: Final = "model.safetensors"
CONFIG_FILE: Final = "config.json"
_KEYS: Final = {"graph_layout", "network", "about"}


class CheckpointError(ValueError):
    """A checkpoint cannot be used. The message names the file and what would be right."""


@dataclass(frozen=True)
class NetworkConfig:
    """What is needed to build a network before its weights are loaded.

    kind: `mpnn`
    sizes: features of the nodes, of every hidden layer, and of the output (Q1 and Q2)
    edge_network: `perceptron` (the paper's) or `tabulated` (ours)
    """

    kind: str
    sizes: tuple[int, ...]
    edge_network: str

    def __post_init__(self) -> None:
        if self.kind != "mpnn":
            raise CheckpointError(f"network kind must be one of ['mpnn'], got {self.kind!r}")
        if self.edge_network not in ("perceptron", "tabulated"):
            raise CheckpointError(f"edge_network must be one of ['perceptron', 'tabulated'], got {self.edge_network!r}")
        if len(self.sizes) < 2 or self.sizes[0] != NUM_NODE_FEATURES or self.sizes[-1] != 2:
            raise CheckpointError(f"sizes must run from {NUM_NODE_FEATURES} to 2, got {list(self.sizes)}")


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """A trained network.

    config: how to build it
    tensors: its state by the names of `reward_model.models.mpnn.MPNN`
    about: where it comes from, for people (JSON values)
    """

    config: NetworkConfig
    tensors: dict[str, Tensor]
    about: dict[str, Any] = field(default_factory=dict)


def save_checkpoint(path: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint folder, replacing an older one.

    Both files are written out beside the folder before either takes its place, so that a full disk or a value that
    JSON cannot hold leaves the older checkpoint as it was. Raises `OSError` where the place cannot be written.
    """
    document = {"graph_layout": LAYOUT_VERSION, "network": asdict(checkpoint.config), "about": checkpoint.about}
    contents = {
        CONFIG_FILE: (json.dumps(document, indent=2) + "\n").encode(),
        WEIGHTS_FILE: save({name: tensor.contiguous() for name, tensor in checkpoint.tensors.items()}),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{path.name}.", dir=path.parent) as folder:
        for name, content in contents.items():
            replace_file(Path(folder) / name, content)
        path.mkdir(exist_ok=True)
        for name in contents:
            (Path(folder) / name).replace(path / name)


def load_checkpoint(path: Path) -> Checkpoint:
    """Read a checkpoint folder.

    Raises `CheckpointError` where a file is missing or broken, or the graph layout is not this version's.
    """
    for name in (CONFIG_FILE, WEIGHTS_FILE):
        if not (path / name).is_file():
            raise CheckpointError(
                f"{path}: a checkpoint folder must hold {CONFIG_FILE} and {WEIGHTS_FILE}, {name} is missing"
            )
    config, about = _read_config(path / CONFIG_FILE)
    try:
        tensors = load_file(path / WEIGHTS_FILE)
    except SafetensorError as error:
        raise CheckpointError(f"{path / WEIGHTS_FILE}: not a readable safetensors file ({error})") from None
    for name, tensor in tensors.items():
        if not torch.isfinite(tensor).all():
            raise CheckpointError(f"{path / WEIGHTS_FILE}: {name} must hold finite numbers only")
    return Checkpoint(config, tensors, about)


def _read_config(path: Path) -> tuple[NetworkConfig, dict[str, Any]]:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise CheckpointError(f"{path}: not readable as JSON ({error})") from None
    if not isinstance(document, dict) or set(document) != _KEYS:
        raise CheckpointError(f"{path}: must be an object with the keys {sorted(_KEYS)}")
    if document["graph_layout"] != LAYOUT_VERSION:
        raise CheckpointError(
            f"{path}: graph_layout must be {LAYOUT_VERSION!r}, got {document['graph_layout']!r}; "
            "this network reads other graphs and has to be trained again"
        )
    network = document["network"]
    expected = {"kind": str, "sizes": list, "edge_network": str}
    if not isinstance(network, dict) or set(network) != set(expected):
        raise CheckpointError(f"{path}: network must be an object with the keys {sorted(expected)}")
    for key, kind in expected.items():
        if not isinstance(network[key], kind):
            raise CheckpointError(f"{path}: network.{key} must be a {kind.__name__}, got {network[key]!r}")
    if not all(type(size) is int and size > 0 for size in network["sizes"]):
        raise CheckpointError(f"{path}: network.sizes must be positive whole numbers, got {network['sizes']}")
    try:
        config = NetworkConfig(network["kind"], tuple(network["sizes"]), network["edge_network"])
    except CheckpointError as error:
        raise CheckpointError(f"{path}: {error}") from None
    return config, document["about"]
