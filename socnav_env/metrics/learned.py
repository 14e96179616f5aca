"""What a reward model thought of the episode. Which one it was, the report has to say."""

from __future__ import annotations

import numpy as np

from reward_model.base.arrays import FloatArray
from socnav_env.metrics.statistics import extreme, mean
from socnav_env.trajectories.trajectory import Trajectory

ACCEPTABLE_SCORE = 0.4  # what raters were told to give where a robot is just acceptable


def q1_mean(trajectory: Trajectory) -> float:
    """Learned Q1, on average over the steps (Bachiller et al. 2021)."""
    return mean(trajectory.scores[:, 0])


def q1_minimum(trajectory: Trajectory) -> float:
    """Learned Q1 of the worst step (Bachiller et al. 2021)."""
    return extreme(np.min, trajectory.scores[:, 0])


def q1_share_below_acceptable(trajectory: Trajectory) -> float:
    """Share of steps with a learned Q1 below 0.4 (Bachiller et al. 2021)."""
    return _share_below_acceptable(trajectory.scores[:, 0])


def q2_mean(trajectory: Trajectory) -> float:
    """Learned Q2, on average over the steps (Bachiller et al. 2021)."""
    return mean(trajectory.scores[:, 1])


def q2_minimum(trajectory: Trajectory) -> float:
    """Learned Q2 of the worst step (Bachiller et al. 2021)."""
    return extreme(np.min, trajectory.scores[:, 1])


def q2_share_below_acceptable(trajectory: Trajectory) -> float:
    """Share of steps with a learned Q2 below 0.4 (Bachiller et al. 2021)."""
    return _share_below_acceptable(trajectory.scores[:, 1])


def _share_below_acceptable(scores: FloatArray) -> float:
    """Unjudged steps make the share unknown, not small."""
    return np.nan if np.isnan(scores).any() else mean(scores < ACCEPTABLE_SCORE)
