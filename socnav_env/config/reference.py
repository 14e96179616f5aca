"""All configuration keys with their defaults and meanings, read from the dataclasses' docstrings."""

from __future__ import annotations

import dataclasses
import inspect
import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import takewhile
from typing import Any

_ENTRY = re.compile(r"((?:\w+, )*\w+): (.*)")
_INDENT = "    "


@dataclass(frozen=True)
class Entry:
    """A configuration key, such as "robot.radius", with its default as JSON and its meaning."""

    key: str
    default: str
    meaning: str


def entries(config: Any, prefix: str = "") -> Iterator[Entry]:
    """All keys of a configuration in order, with its values as defaults; keys of a part start with the part's name.

    Raises:
        ValueError: For a key whose meaning the docstring of its class does not give.
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
    """Meaning of each name in a dataclass's docstring: "name: ..." or "name, name: ..." below "Attributes:"."""
    meanings: dict[str, str] = {}
    names: list[str] = []
    _, _, section = inspect.cleandoc(kind.__doc__ or "").partition("\nAttributes:\n")
    for line in takewhile(lambda line: line.startswith(_INDENT), section.splitlines()):
        found = _ENTRY.fullmatch(line.removeprefix(_INDENT))
        if found:
            names = found[1].split(", ")
            meanings.update(dict.fromkeys(names, found[2]))
        else:
            meanings.update({name: f"{meanings[name]} {line.strip()}" for name in names})
    return meanings
