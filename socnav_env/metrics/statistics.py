"""What several measures do with the numbers of an episode."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from reward_model.base.arrays import BoolArray, FloatArray


def mean(values: FloatArray | BoolArray) -> float:
    """The mean; NaN of nothing."""
    return float(np.mean(values)) if len(values) else np.nan


def extreme(choose: Callable[[FloatArray], np.floating], values: FloatArray) -> float:
    """The value that `choose`, `np.min` or `np.max`, finds; NaN of nothing."""
    return float(choose(values)) if len(values) else np.nan


def finite(value: float | np.floating) -> float:
    """NaN for what is infinite, like the distance to nobody."""
    return float(value) if np.isfinite(value) else np.nan


def share_of_time(flags: BoolArray, durations: FloatArray) -> float:
    """[% of time] that the steps which are flagged take; NaN in no time."""
    return 100.0 * float(durations[flags].sum() / durations.sum()) if len(durations) else np.nan
