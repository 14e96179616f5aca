"""A network's operators on disk, where they take seconds to compute: those of perceptron edge networks."""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Final

from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor

from reward_model.base.files import replace_file
from reward_model.networks.edge_networks import LayerOperators, PerceptronEdgeNetwork

OPERATORS_FILE: Final = "operators.safetensors"
_VERSION: Final = "socnav2-operators-1"  # changes whenever operators are computed otherwise
_KEY: Final = "key"
_PARTS: Final = tuple(field.name for field in fields(LayerOperators))


def kept_operators(
    path: Path, tensors: Mapping[str, Tensor], make: Callable[[], list[LayerOperators]]
) -> list[LayerOperators]:
    """The operators of a network with these tensors, from the file where they are there, else from `make`.

    The file is written, whole or not at all, where it is missing, damaged or of other tensors. Where it cannot be
    written, the next call has to compute again, no more.
    """
    key = _key(tensors)
    operators = _read(path, key)
    if operators is None:
        operators = make()
        parts = {
            f"{index}.{name}": getattr(layer, name).contiguous()
            for index, layer in enumerate(operators)
            for name in _PARTS
        }
        with contextlib.suppress(OSError):
            replace_file(path, save(parts, metadata={_KEY: key}))
    return operators


def _read(path: Path, key: str) -> list[LayerOperators] | None:
    try:
        with safe_open(path, framework="pt") as file:
            if (file.metadata() or {}).get(_KEY) != key:
                return None
            names = set(file.keys())
            return [
                LayerOperators(*(file.get_tensor(f"{index}.{name}") for name in _PARTS))
                for index in range(len(names) // len(_PARTS))
            ]
    except (OSError, SafetensorError):
        return None


def _key(tensors: Mapping[str, Tensor]) -> str:
    settings = (_VERSION, *(getattr(PerceptronEdgeNetwork, name) for name in ("RANK", "NUMBERS", "NUM_LENGTHS")))
    digest = hashlib.sha256(repr(settings).encode())
    for name in sorted(tensors):
        digest.update(f"{name} {tuple(tensors[name].shape)}".encode())
        digest.update(tensors[name].contiguous().numpy().data)
    return digest.hexdigest()
