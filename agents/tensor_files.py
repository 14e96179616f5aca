"""Tensors with a JSON description in one safetensors file; nothing is ever unpickled."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor

from agents.errors import AgentError
from reward_model.base.files import replace_file


def write_tensors(path: Path, layout: str, tensors: dict[str, Tensor], description: dict[str, Any]) -> None:
    """Write tensors and what describes them; equal contents give equal bytes. layout: names what the file holds."""
    # One entry: safetensors writes several in any order.
    replace_file(path, save(tensors, metadata={layout: json.dumps(description)}))


def read_tensors(path: Path, layout: str) -> tuple[dict[str, Tensor], dict[str, Any]]:
    """Return what `write_tensors` wrote. Raises `AgentError` naming the file if it holds anything else."""
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
