"""Checked access to the values of a scenario file; errors name the file, the field and the rule."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Final, TypeVar

import numpy as np
import yaml

from socnav_env.config.checks import ConfigError

Item = TypeVar("Item")

_short = reprlib.Repr()
_short.maxlist, _short.maxdict, _short.maxlevel, _short.maxstring = 4, 4, 3, 60
FURTHEST: Final = 1e3  # limit of any number: metres, seconds or radians


@dataclass(frozen=True)
class Amount:
    """A number in the file, or a range that it is drawn from for every episode."""

    least: float
    most: float

    @property
    def is_fixed(self) -> bool:
        """Whether the number is always the same."""
        return self.least == self.most

    def draw(self, rng: np.random.Generator) -> float:
        """Draw a value; a fixed one takes no random number."""
        return self.least if self.is_fixed else float(rng.uniform(self.least, self.most))


@dataclass(frozen=True)
class Field:
    """A value in a file, and its place there.

    Attributes:
        path: of the value in the file, e.g. `people[2].speed`; empty at the top
    """

    value: object
    file: str
    path: str = ""

    def fields(self, valid: Iterable[str]) -> dict[str, Field]:
        """Return the value under each name; names that are not `valid` are refused."""
        if not isinstance(self.value, dict):
            raise self.refused("must be fields and their values")
        names = tuple(valid)
        for name in self.value:
            if name not in names:
                place = f"{self.path}: " if self.path else ""
                shown = name if isinstance(name, str) else _short.repr(name)
                raise ConfigError(f"{self.file}: {place}unknown field {shown}; the valid ones are {', '.join(names)}")
        # A name without a value is the same as a missing one.
        return {
            name: Field(value, self.file, f"{self.path}.{name}" if self.path else name)
            for name, value in self.value.items()
            if value is not None
        }

    def items(self) -> list[Field]:
        """Return the items of a list."""
        if not isinstance(self.value, list):
            raise self.refused("must be a list")
        return [Field(item, self.file, f"{self.path}[{index}]") for index, item in enumerate(self.value)]

    def pair(self, rule: str) -> tuple[Field, Field]:
        """Return the two items of a list."""
        if not isinstance(self.value, list) or len(self.value) != 2:
            raise self.refused(rule)
        first, second = self.items()
        return first, second

    def number(self, least: float = -FURTHEST, most: float = FURTHEST) -> float:
        """Return a number from `least` to `most`."""
        value = self.value
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise self.refused("must be a number")
        if not least <= value <= most:
            raise self.refused(f"must be from {least:g} to {most:g}")
        return float(value)

    def amount(self, least: float = -FURTHEST, most: float = FURTHEST) -> Amount:
        """Return a number, or the range [least, most] that it is drawn from."""
        if not isinstance(self.value, list):
            number = self.number(least, most)
            return Amount(number, number)
        low, high = (each.number(least, most) for each in self.pair("must be a number or a range [least, most]"))
        if high < low:
            raise self.refused("must be a range that rises, [least, most]")
        return Amount(low, high)

    def whole(self, least: int, most: int) -> tuple[int, int]:
        """Return a whole number, or a range of them, as least and most."""
        amount = self.amount(least, most)
        if amount.least % 1 or amount.most % 1:
            raise self.refused("must be whole")
        return int(amount.least), int(amount.most)

    def text(self) -> str:
        """Return a text."""
        if not isinstance(self.value, str):
            raise self.refused("must be a text")
        return self.value

    def one_of(self, valid: Iterable[str]) -> str:
        """Return a text out of `valid`."""
        names = tuple(valid)
        if self.value not in names:
            raise self.refused(f"must be one of {', '.join(names)}")
        return str(self.value)

    def refused(self, rule: str) -> ConfigError:
        """Return the error that this value breaks a rule, for the caller to raise."""
        subject = f"{self.path} {rule}" if self.path else rule
        return ConfigError(f"{self.file}: {subject}, got {_short.repr(self.value)}")


def required(fields: dict[str, Field], name: str, parent: Field) -> Field:
    """Return the field of this name; raises `ConfigError` if it is missing."""
    if name not in fields:
        place = f"{parent.path}.{name}" if parent.path else name
        raise ConfigError(f"{parent.file}: {place} is missing")
    return fields[name]


def optional(fields: dict[str, Field], name: str, read: Callable[[Field], Item], default: Item) -> Item:
    """Read the field of this name; return the default if it is missing."""
    return read(fields[name]) if name in fields else default


class _Loader(yaml.SafeLoader):
    """A YAML loader of plain values that refuses repeated fields."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen: set[str] = set()
        for key, _ in node.value:
            name = str(key.value)
            if name in seen:
                raise yaml.constructor.ConstructorError(None, None, f"field {name} stands here twice", key.start_mark)
            seen.add(name)
        return super().construct_mapping(node, deep)


def read_yaml(text: str, file: str) -> Field:
    """Return the contents of a YAML text; raises `ConfigError` naming line and column if it is invalid."""
    try:
        return Field(yaml.load(text, _Loader), file)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        where = "" if mark is None else f"line {mark.line + 1}, column {mark.column + 1}: "
        raise ConfigError(f"{file}: {where}must be YAML: {error.problem}") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ConfigError(f"{file}: must be YAML: {str(error).splitlines()[0]}") from None
