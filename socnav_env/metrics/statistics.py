"""Statistics that several measures share."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from reward_model.base.arrays import BoolArray, FloatArray


def mean(values: FloatArray | BoolArray) -> float:
    """The mean; NaN of an empty array."""
    return float(np.mean(values)) if len(values) else np.nan


def extreme(choose: Callable[[FloatArray], np.floating], values: FloatArray) -> float:
    """The value that `choose`, `np.min` or `np.max`, returns; NaN of an empty array."""
    return float(choose(values)) if len(values) else np.nan


def finite(value: float | np.floating) -> float:
    """The value; NaN if it is infinite, like the distance to nobody."""
    return float(value) if np.isfinite(value) else np.nan


def share_of_time(flags: BoolArray, durations: FloatArray) -> float:
    """[% of time] of the flagged steps; NaN without steps."""
    return 100.0 * float(durations[flags].sum() / durations.sum()) if len(durations) else np.nan
