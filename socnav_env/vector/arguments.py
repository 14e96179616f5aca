"""What the vector environments check of what they are given, whether their worlds are here or elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import ArrayLike

from reward_model.base.arrays import BoolArray, FloatArray
from socnav_env.config import EnvConfig
from socnav_env.simulation.actions import refusal_of, scaled

Seeds = int | Sequence[int | None] | None


def autoreset_mode_of(mode: AutoresetMode | str) -> AutoresetMode:
    """Return the mode that goes by this name. Raises `ValueError` where there is none."""
    try:
        return AutoresetMode(mode)
    except ValueError:
        valid = ", ".join(each.value for each in AutoresetMode)
        raise ValueError(f"autoreset_mode must be one of {valid}, got {mode!r}") from None


def seeds_of(seed: Seeds, num_envs: int) -> Sequence[int | None]:
    """Return a seed for each world: from a list of as many, counted upwards from an int, or None for none.

    Raises:
        ValueError: For a list of another length.
    """
    if seed is None:
        return [None] * num_envs
    if isinstance(seed, int):
        return range(seed, seed + num_envs)
    if len(seed) != num_envs:
        raise ValueError(f"seed must be one for each of the {num_envs} worlds, got {len(seed)}")
    return seed


def named_by(mask: Any, has_scene: Sequence[bool] | BoolArray) -> list[int]:
    """Return the indices of the worlds that a reset mask names, all if there is none.

    Args:
        has_scene: (num_envs,) which worlds have been reset before

    Raises:
        TypeError: Or `ValueError` for something that is no such mask.
        ResetNeeded: If it leaves a world as it is that has no scene yet.
    """
    num_envs = len(has_scene)
    if mask is None:
        return list(range(num_envs))
    if not (isinstance(mask, np.ndarray) and mask.dtype == np.bool_):
        raise TypeError(f"reset_mask must be a bool array, got {getattr(mask, 'dtype', type(mask).__name__)}")
    if mask.shape != (num_envs,):
        raise ValueError(f"reset_mask must have shape {(num_envs,)}, got {mask.shape}")
    if not mask.any():
        raise ValueError("reset_mask must name at least one world, got none")
    without_scene = np.flatnonzero(~mask & ~np.asarray(has_scene)).tolist()
    if without_scene:
        raise gym.error.ResetNeeded(f"reset_mask must name world {without_scene[0]}, which has no scene yet")
    return np.flatnonzero(mask).tolist()


def commands_of(
    actions: ArrayLike, chosen: Sequence[int], shape: tuple[int, ...] | None, config: EnvConfig
) -> list[FloatArray]:
    """Translate the actions of the chosen worlds into commands.

    Args:
        actions: of `shape`, a row for each world

    Raises:
        ValueError: For another shape, and for a row of a chosen world that is not finite.
    """
    values = np.asarray(actions, dtype=np.float64)
    if values.shape != shape:
        raise ValueError(f"actions must have shape {shape}, got {values.shape}")
    rows = values[list(chosen)]
    finite = np.isfinite(rows).all(axis=1)
    if not finite.all():
        odd = int(finite.argmin())
        raise ValueError(f"world {chosen[odd]}: {refusal_of(rows[odd], config.robot)}")
    return list(scaled(rows, config.robot))


def values_for(values: Any, num_envs: int) -> Sequence[Any]:
    """Return a value for each world, from a list or tuple of as many or from one for all. Raises `ValueError`."""
    each = values if isinstance(values, list | tuple) else [values] * num_envs
    if len(each) != num_envs:
        raise ValueError(f"values must be one for each of the {num_envs} worlds, got {len(each)}")
    return each
