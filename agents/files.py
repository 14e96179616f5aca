"""JSON files of runs and evaluations."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from agents.errors import AgentError
from reward_model.base.files import replace_file


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


def _sayable(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _sayable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_sayable(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
