"""The files of runs and agents: JSON, and tensors with a JSON description; and the error that names a broken one.

Nothing is ever unpickled. PyTorch is loaded when tensors are read or written, not before.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from reward_model.base.files import replace_file

if TYPE_CHECKING:
    from torch import Tensor


class AgentError(ValueError):
    """Something the user asked for cannot be done. The message gives the rule, the value and the remedy."""


def require(holds: bool, message: str) -> None:
    """Raise `AgentError` with the message unless the rule holds."""
    if not holds:
        raise AgentError(message)


def write_json(path: Path, value: Any) -> None:
    """Write `value` as JSON; numbers that JSON cannot say (NaN, infinities) become null."""
    replace_file(path, (json.dumps(_sayable(value), indent=2, allow_nan=False) + "\n").encode())


def read_json(path: Path) -> Any:
    """Return what a JSON file holds. Raises `AgentError` naming the file that is missing or broken."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise AgentError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise AgentError(f"{path}: is not valid JSON: {error}") from error


def read_object(path: Path) -> dict[str, Any]:
    """Return the object that a JSON file holds. Raises `AgentError` as `read_json` does, and for other values."""
    value = read_json(path)
    if not isinstance(value, dict):
        raise AgentError(f"{path}: must hold a JSON object, got {type(value).__name__}")
    return value


def write_tensors(path: Path, layout: str, tensors: dict[str, Tensor], description: dict[str, Any]) -> None:
    """Write tensors and what describes them; equal contents give equal bytes. layout: names what the file holds."""
    from safetensors.torch import save

    # One entry: safetensors writes several in any order.
    replace_file(path, save(tensors, metadata={layout: json.dumps(description)}))


def read_tensors(path: Path, layout: str) -> tuple[dict[str, Tensor], dict[str, Any]]:
    """Return what `write_tensors` wrote. Raises `AgentError` naming the file if it holds anything else."""
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(path, framework="pt") as stored:
            metadata = stored.metadata() or {}
            tensors = {name: stored.get_tensor(name) for name in stored.keys()}  # noqa: SIM118 no mapping
    except (OSError, SafetensorError) as error:
        raise AgentError(f"{path}: is no file of tensors: {error}") from error
    if layout not in metadata:
        found = ", ".join(metadata) or "nothing"
        raise AgentError(f"{path}: its header must describe a {layout}, got {found}")
    return tensors, json.loads(metadata[layout])


def _sayable(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _sayable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_sayable(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
