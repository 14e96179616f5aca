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
from reward_model.graph.features import LAYOUT_VERSION
from reward_model.networks.registry import NETWORKS, NetworkConfig, network_config

WEIGHTS_FILE: Final = "model.safetensors"
CONFIG_FILE: Final = "config.json"
_KEYS: Final = {"graph_layout", "network", "about"}


class CheckpointError(ValueError):
    """A checkpoint cannot be used. The message names the file and what would be right."""


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """A trained network.

    Attributes:
        config: how to build it
        tensors: its state by the names of its class
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

    Raises:
        CheckpointError: If a file is missing or broken, or the graph layout is not this version's.
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


def check_tensors(checkpoint: Checkpoint, shapes: Mapping[str, tuple[int, ...]]) -> None:
    """Raise `CheckpointError` where a checkpoint's tensors are not those of its network, by name and shape."""
    found = {name: tuple(tensor.shape) for name, tensor in checkpoint.tensors.items()}
    fits = f"the weights do not fit the network {_describe(checkpoint.config)}"
    if odd := sorted(shapes.keys() ^ found.keys()):
        raise CheckpointError(f"{fits}: {odd[0]} is {'missing' if odd[0] in shapes else 'not part of it'}")
    for name, shape in shapes.items():
        if found[name] != shape:
            raise CheckpointError(f"{fits}: {name} must have shape {shape}, got {found[name]}")


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
    except ValueError as error:
        raise CheckpointError(f"{path}: {error}") from None
    return config, document["about"]


def _parse_network(network: object) -> NetworkConfig:
    if not isinstance(network, dict) or not isinstance(network.get("kind"), str):
        raise CheckpointError(f"network must be an object whose kind is one of {sorted(NETWORKS)}")
    if network["kind"] not in NETWORKS:
        raise CheckpointError(f"network kind must be one of {sorted(NETWORKS)}, got {network['kind']!r}")
    options = NETWORKS[network["kind"]].config.option_fields()
    expected = {"kind": str, "sizes": list} | {
        name: str if field.choices else field.type for name, field in options.items()
    }
    if set(network) != set(expected):
        raise CheckpointError(f"network must be an object with the keys {sorted(expected)}")
    for key, kind in expected.items():
        if type(network[key]) is not kind and not (kind is float and type(network[key]) is int):
            raise CheckpointError(f"network.{key} must be a {kind.__name__}, got {network[key]!r}")
    if not all(type(size) is int and size > 0 for size in network["sizes"]):
        raise CheckpointError(f"network.sizes must be positive whole numbers, got {network['sizes']}")
    return network_config(network["kind"], tuple(network["sizes"]), {name: network[name] for name in options})


def _describe(config: NetworkConfig) -> str:
    options = ", ".join(map(str, config.options().values()))
    return f"{config.kind} {'-'.join(map(str, config.sizes))}" + (f" ({options})" if options else "")
