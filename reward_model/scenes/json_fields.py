"""Checked access to the content of a JSON file; errors name the file, the field and the rule."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from reward_model.base.arrays import FloatArray
from reward_model.scenes.scene import ScenarioError

_LONGEST_VALUE_SHOWN = 60  # characters
_INT64 = np.iinfo(np.int64)


@dataclass(frozen=True)
class JsonField:
    """A value inside a decoded JSON document, and its position.

    Attributes:
        value: the decoded value
        place: the start of error messages, e.g. `scene.json: snapshot 3`
        path: from there to the value, e.g. `people[2].vx`; empty at the root
    """

    value: object
    place: str
    path: str = ""

    def __getitem__(self, key: str) -> JsonField:
        """Return the field of that name; `ScenarioError` where it is missing or this is no JSON object."""
        found = self.get(key)
        if found is None:
            raise ScenarioError(f"{self.place}: {self._path_to(key)} is missing")
        return found

    def get(self, key: str) -> JsonField | None:
        """Return the field of that name or None; `ScenarioError` where this is no JSON object."""
        if not isinstance(self.value, dict):
            raise self.refused("must be a JSON object")
        return JsonField(self.value[key], self.place, self._path_to(key)) if key in self.value else None

    def items(self) -> list[JsonField]:
        """Return the items of a list; anything else raises `ScenarioError`."""
        if not isinstance(self.value, list):
            raise self.refused("must be a list")
        return [JsonField(item, self.place, f"{self.path}[{i}]") for i, item in enumerate(self.value)]

    def number(self) -> float:
        """Return a finite number; anything else raises `ScenarioError`."""
        if isinstance(self.value, int | float) and not isinstance(self.value, bool):
            try:
                number = float(self.value)
            except OverflowError:
                number = math.inf
            if math.isfinite(number):
                return number
        raise self.refused("must be a finite number")

    def integer(self) -> int:
        """Return an integer of 64 bits; anything else raises `ScenarioError`."""
        if type(self.value) is not int or not _INT64.min <= self.value <= _INT64.max:
            raise self.refused("must be an integer")
        return self.value

    def text(self) -> str:
        """Return a string; anything else raises `ScenarioError`."""
        if not isinstance(self.value, str):
            raise self.refused("must be a string")
        return self.value

    def numbers(self, count: int) -> FloatArray:
        """Return a list of finite numbers, (count,); anything else raises `ScenarioError`."""
        items = self.items()
        if len(items) != count:
            raise ScenarioError(f"{self.place}: {self.path} must hold {count} numbers, got {len(items)}")
        return np.array([item.number() for item in items], dtype=np.float64)

    def table(self, keys: Sequence[str]) -> FloatArray:
        """Return the named numbers of a list's objects, (num_items, num_keys); else `ScenarioError`."""
        columns = len(keys)
        table = _plain_table(self.value, keys)
        if table is None:
            rows = [[item[key].number() for key in keys] for item in self.items()]
            table = np.array(rows, dtype=np.float64).reshape(len(rows), columns)
        return table

    def refused(self, rule: str) -> ScenarioError:
        """Make the error that this value breaks a rule, for the caller to raise."""
        subject = f"{self.path} {rule}" if self.path else rule
        return ScenarioError(f"{self.place}: {subject}, got {_shown(self.value)}")

    def _path_to(self, key: str) -> str:
        return f"{self.path}.{key}" if self.path else key


def read_text_file(path: str | os.PathLike[str]) -> str:
    """Return the text of a file; `ScenarioError` where it cannot be read or is not UTF-8."""
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ScenarioError(f"{os.fspath(path)}: cannot read it: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{os.fspath(path)}: must be UTF-8 text, byte {error.start} is not") from error


def decode_json(text: str, place: Callable[[int], str]) -> object:
    """Decode a JSON text.

    Args:
        place: maps a line number, counted from 1, to its name in error messages

    Raises:
        ScenarioError: Naming line and column where the text is no JSON.
    """
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        where = f"{place(error.lineno)}, column {error.colno}"
        raise ScenarioError(f"{where}: must be JSON: {error.msg}") from error
    except RecursionError as error:
        raise ScenarioError(f"{place(1)}: must be JSON that is not nested this deeply") from error
    except ValueError as error:
        raise ScenarioError(f"{place(1)}: must be JSON: {error}") from error


def _plain_table(value: object, keys: Sequence[str]) -> FloatArray | None:
    """Return the table (num_items, num_keys), or None where a field is invalid."""
    if not isinstance(value, list) or not value:
        return None
    try:
        rows = [[item[key] for key in keys] for item in value]
        if not all(type(number) in (int, float) for row in rows for number in row):
            return None
        table = np.array(rows, dtype=np.float64)
    except (KeyError, TypeError, IndexError, OverflowError):
        return None
    return table if np.isfinite(table).all() else None


def _shown(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= _LONGEST_VALUE_SHOWN else f"{text[: _LONGEST_VALUE_SHOWN - 3]}..."
