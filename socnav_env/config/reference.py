"""Every key of the configuration with its default and its meaning, as the docstrings of the dataclasses say it."""

from __future__ import annotations

import dataclasses
import inspect
import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

_ENTRY = re.compile(r"((?:\w+, )*\w+): (.*)")
_INDENT = "    "


@dataclass(frozen=True)
class Entry:
    """One key, such as "robot.radius", its default as JSON, and what it means."""

    key: str
    default: str
    meaning: str


def entries(config: Any, prefix: str = "") -> Iterator[Entry]:
    """All keys of a configuration, with its values for defaults, in order; those of its parts after their own names.

    Raises `ValueError` for a key whose class does not say what it means.
    """
    meanings = _meanings(type(config))
    for each in dataclasses.fields(config):
        value = getattr(config, each.name)
        if dataclasses.is_dataclass(value):
            yield from entries(value, f"{prefix}{each.name}.")
        elif each.name not in meanings:
            raise ValueError(f"the docstring of {type(config).__name__} must say what {each.name} means")
        else:
            yield Entry(f"{prefix}{each.name}", json.dumps(value), meanings[each.name])


def _meanings(kind: type) -> dict[str, str]:
    """By name, what the docstring of a dataclass says: entries "name: ..." or "name, name: ...", others indented."""
    meanings: dict[str, str] = {}
    names: list[str] = []
    for line in inspect.cleandoc(kind.__doc__ or "").splitlines():
        found = _ENTRY.fullmatch(line)
        if found:
            names = found[1].split(", ")
            meanings.update(dict.fromkeys(names, found[2]))
        elif line.startswith(_INDENT):
            meanings.update({name: f"{meanings[name]} {line.strip()}" for name in names})
        else:
            names = []
    return meanings
