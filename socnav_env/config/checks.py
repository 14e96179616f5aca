"""Checks of configuration values; each error names the key, the rule and the value."""

from __future__ import annotations

import math
from collections.abc import Iterable

IntRange = tuple[int, int]
FloatRange = tuple[float, float]


class ConfigError(ValueError):
    """A configuration breaks a rule, or asks for a scene that cannot be made."""


def _is_number(value: object, whole: bool = False) -> bool:
    kinds = int if whole else (int, float)
    return isinstance(value, kinds) and not isinstance(value, bool) and math.isfinite(value)


def check_number(name: str, value: object, least: float, most: float, whole: bool = False) -> None:
    """Refuse a value that is not a finite number, or whole number, from `least` to `most`."""
    if not (_is_number(value, whole) and least <= value <= most):  # type: ignore[operator]
        kind = "a whole number" if whole else "a number"
        limits = f" of at least {least}" if most == math.inf else f" from {least} to {most}"
        raise ConfigError(f"{name} must be {kind}{limits if least > -math.inf else ''}, got {value!r}")


def check_range(name: str, value: object, least: float, whole: bool = False) -> None:
    """Refuse a value that is not a pair of numbers in ascending order, both at least `least`."""
    kind = "whole numbers" if whole else "numbers"
    if not (isinstance(value, tuple) and len(value) == 2 and all(_is_number(each, whole) for each in value)):
        raise ConfigError(f"{name} must be two {kind} (least, most), got {value!r}")
    if value[0] < least or value[1] < value[0]:
        raise ConfigError(f"{name} must rise from at least {least}, got {value[0]} and {value[1]}")


def check_names(name: str, values: object, valid: Iterable[str]) -> None:
    """Refuse a value that is not a tuple of different names from `valid`."""
    known = tuple(valid)
    if not isinstance(values, tuple) or not values:
        raise ConfigError(f"{name} must name at least one of {', '.join(known)}, got {values!r}")
    for value in values:
        if value not in known:
            raise ConfigError(f"{name} must be of {', '.join(known)}, got {value!r}")
    if len(set(values)) < len(values):
        raise ConfigError(f"{name} must name each kind once, got {', '.join(values)}")


def check_flag(name: str, value: object) -> None:
    """Refuse a value that is neither True nor False."""
    if not isinstance(value, bool):
        raise ConfigError(f"{name} must be true or false, got {value!r}")


def check_choice(name: str, value: object, valid: Iterable[str]) -> None:
    """Refuse a value that is not one of `valid`."""
    known = tuple(valid)
    if value not in known:
        raise ConfigError(f"{name} must be one of {', '.join(known)}, got {value!r}")


def check_weights(name: str, weights: object, of: str, count: int) -> None:
    """Refuse weights that are neither empty nor `count` numbers of at least 0, not all 0."""
    if not isinstance(weights, tuple) or not all(_is_number(each) and each >= 0 for each in weights):
        raise ConfigError(f"{name} must be numbers of at least 0, got {weights!r}")
    if weights and (len(weights) != count or not sum(weights) > 0):
        raise ConfigError(f"{name} must be one number for each of {of}, not all 0, got {weights} for {count}")


def check_whole(name: str, duration: float, unit: str, step: float) -> None:
    """Refuse a duration that is not a whole number of steps."""
    count = duration / step
    if abs(count - round(count)) > 1e-9 * max(1.0, count):
        raise ConfigError(f"{name} must be a whole number of {unit}s, got {duration} and {step}")
