"""The state of a running training on disk: one safetensors file, written atomically.

Everything that is no tensor is JSON in the file's metadata, so that a killed process cannot leave one without the
other.
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import torch
from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import Tensor

from reward_model.base.files import replace_file

_VERSION: Final = "socnav2-training-1"
_KEYS: Final = {"version", "run", "progress"}


class TrainingStateError(ValueError):
    """A training cannot be resumed. The message names the file and the rule."""


@dataclass(frozen=True, eq=False)
class TrainingState:
    """The state from which a training continues as if it had not been interrupted.

    Attributes:
        run: the training's data and options; resuming with others is refused
        progress: JSON values
        tensors: of the network, the optimizer and the generators
    """

    run: dict[str, Any]
    progress: dict[str, Any]
    tensors: dict[str, Tensor]


def save_state(path: Path, state: TrainingState) -> None:
    """Write the file. Raises `OSError` where it cannot be written."""
    document = {"version": _VERSION, "run": state.run, "progress": state.progress}
    tensors = {name: tensor.detach().cpu().contiguous().clone() for name, tensor in state.tensors.items()}
    replace_file(path, save(tensors, metadata={"training": json.dumps(document)}))


def load_state(path: Path, run: dict[str, Any]) -> TrainingState:
    """Read the state of the training with this `run`.

    Raises:
        TrainingStateError: If the file is missing or broken, or its `run` is another: the first entry that differs is
            named.
    """
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise TrainingStateError(f"{path}: there is no training to go on with; start one without resume") from None
    try:
        tensors = load(content)
        (size,) = struct.unpack_from("<Q", content)
        document = json.loads(json.loads(content[8 : 8 + size])["__metadata__"]["training"])
    except (SafetensorError, ValueError, KeyError, TypeError, struct.error) as error:
        raise TrainingStateError(f"{path}: not a readable training state ({error})") from None
    if not isinstance(document, dict) or set(document) != _KEYS or document["version"] != _VERSION:
        raise TrainingStateError(f"{path}: must be a training state of version {_VERSION!r}")
    check_same(path, document["run"], run)
    return TrainingState(document["run"], document["progress"], tensors)


def check_same(path: Path, saved: dict[str, Any], run: dict[str, Any], what: str = "a training") -> None:
    """Raise `TrainingStateError` where the saved run is not the present one, naming the first difference."""
    now = json.loads(json.dumps(run))
    for name in sorted(saved.keys() | now.keys()):
        if saved.get(name) != now.get(name):
            raise TrainingStateError(
                f"{path}: {what} is gone on with as it was begun, {name} was {saved.get(name)}, got {now.get(name)}"
            )


def generator_tensors() -> dict[str, Tensor]:
    """The states of PyTorch's own generators, which dropout draws from."""
    tensors = {"generator.cpu": torch.get_rng_state()}
    if torch.cuda.is_available():
        tensors["generator.cuda"] = torch.cuda.get_rng_state()
    return tensors


def restore_generators(tensors: dict[str, Tensor]) -> None:
    """Restore the states of PyTorch's generators."""
    torch.set_rng_state(tensors["generator.cpu"])
    if "generator.cuda" in tensors and torch.cuda.is_available():
        torch.cuda.set_rng_state(tensors["generator.cuda"])


def named(prefix: str, tensors: dict[str, Tensor]) -> dict[str, Tensor]:
    """Tensors under a prefix, so that several sets fit into one file."""
    return {f"{prefix}.{name}": tensor for name, tensor in tensors.items()}


def unnamed(prefix: str, tensors: dict[str, Tensor]) -> dict[str, Tensor]:
    """The tensors under a prefix, without it."""
    start = f"{prefix}."
    return {name.removeprefix(start): tensor for name, tensor in tensors.items() if name.startswith(start)}
