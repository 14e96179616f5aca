"""Trained networks on disk: a folder with `model.safetensors` and `config.json`. Nothing is ever unpickled."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save
from torch import Tensor

from reward_model.base.files import replace_file
from reward_model.graph.features import LAYOUT_VERSION, NUM_NODE_FEATURES

WEIGHTS_FILE: Final = "model.safetensors"
CONFIG_FILE: Final = "config.json"
_KEYS: Final = {"graph_layout", "network", "about"}
_OPTIONS: Final[Mapping[str, Mapping[str, type]]] = {
    "mpnn": {"edge_network": str},
    "rgcn": {"num_bases": int, "dropout": float},
    "gat": {"num_heads": int, "negative_slope": float, "dropout": float},
}
_ALL_OPTIONS: Final = {name for options in _OPTIONS.values() for name in options}
_EDGE_NETWORKS: Final = ("perceptron", "tabulated")


class CheckpointError(ValueError):
    """A checkpoint cannot be used. The message names the file and what would be right."""


@dataclass(frozen=True)
class NetworkConfig:
    """What is needed to build a network before its weights are loaded.

    kind: `mpnn`, `rgcn` or `gat`; the fields that are not a kind's own keep their defaults
    sizes: features of the nodes, of every hidden layer (of every head for `gat`), and of the output (Q1 and Q2)
    edge_network: of `mpnn`, `perceptron` (the paper's) or `tabulated` (ours)
    num_bases: of `rgcn`, matrices that those of the relations are mixed from
    num_heads, negative_slope: of `gat`
    dropout: of `rgcn` and `gat`, in training
    """

    kind: str
    sizes: tuple[int, ...]
    edge_network: str = ""
    num_bases: int = 0
    num_heads: int = 0
    negative_slope: float = 0.0
    dropout: float = 0.0

    def __post_init__(self) -> None:
        if self.kind not in _OPTIONS:
            raise CheckpointError(f"network kind must be one of {sorted(_OPTIONS)}, got {self.kind!r}")
        if len(self.sizes) < 2 or self.sizes[0] != NUM_NODE_FEATURES or self.sizes[-1] != 2:
            raise CheckpointError(f"sizes must run from {NUM_NODE_FEATURES} to 2, got {list(self.sizes)}")
        for name in sorted(_ALL_OPTIONS):
            value = getattr(self, name)
            if name in _OPTIONS[self.kind]:
                _check_option(name, value)
            elif value:
                raise CheckpointError(f"{name} is no option of {self.kind}, which takes {_option_names(self.kind)}")

    def document(self) -> dict[str, Any]:
        """What a checkpoint's JSON says of it: the kind, the sizes and the kind's own options."""
        return {"kind": self.kind, "sizes": list(self.sizes)} | {
            name: getattr(self, name) for name in _OPTIONS[self.kind]
        }


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """A trained network.

    config: how to build it
    tensors: its state by the names of its class in `reward_model.models`
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
    document = {"graph_layout": LAYOUT_VERSION, "network": checkpoint.config.document(), "about": checkpoint.about}
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
    try:
        config = _parse_network(document["network"])
    except CheckpointError as error:
        raise CheckpointError(f"{path}: {error}") from None
    return config, document["about"]


def _parse_network(network: object) -> NetworkConfig:
    if not isinstance(network, dict) or not isinstance(network.get("kind"), str):
        raise CheckpointError(f"network must be an object whose kind is one of {sorted(_OPTIONS)}")
    if network["kind"] not in _OPTIONS:
        raise CheckpointError(f"network kind must be one of {sorted(_OPTIONS)}, got {network['kind']!r}")
    expected = {"kind": str, "sizes": list, **_OPTIONS[network["kind"]]}
    if set(network) != set(expected):
        raise CheckpointError(f"network must be an object with the keys {sorted(expected)}")
    for key, kind in expected.items():
        if type(network[key]) is not kind and not (kind is float and type(network[key]) is int):
            raise CheckpointError(f"network.{key} must be a {kind.__name__}, got {network[key]!r}")
    if not all(type(size) is int and size > 0 for size in network["sizes"]):
        raise CheckpointError(f"network.sizes must be positive whole numbers, got {network['sizes']}")
    return NetworkConfig(**network | {"sizes": tuple(network["sizes"])})


def _check_option(name: str, value: Any) -> None:
    if name == "edge_network" and value not in _EDGE_NETWORKS:
        raise CheckpointError(f"edge_network must be one of {list(_EDGE_NETWORKS)}, got {value!r}")
    if name in ("num_bases", "num_heads") and value < 1:
        raise CheckpointError(f"{name} must be at least 1, got {value}")
    if name in ("dropout", "negative_slope") and not 0 <= value < 1:
        raise CheckpointError(f"{name} must lie in 0..1, 1 excluded, got {value}")


def _option_names(kind: str) -> list[str]:
    return sorted(_OPTIONS[kind])
