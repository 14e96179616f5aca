"""Scores that a reward model gave the episode. A report must name the model."""

from __future__ import annotations

import numpy as np

from reward_model.base.arrays import FloatArray
from socnav_env.metrics.statistics import extreme, mean
from socnav_env.trajectories.trajectory import Trajectory

ACCEPTABLE_SCORE = 0.4  # score of a robot that is just acceptable, in the raters' instructions


def q1_mean(trajectory: Trajectory) -> float:
    """Mean learned Q1 over the steps (Bachiller et al. 2021)."""
    return mean(trajectory.scores[:, 0])


def q1_minimum(trajectory: Trajectory) -> float:
    """Minimum learned Q1 over the steps (Bachiller et al. 2021)."""
    return extreme(np.min, trajectory.scores[:, 0])


def q1_share_below_acceptable(trajectory: Trajectory) -> float:
    """Share of steps with a learned Q1 below 0.4 (Bachiller et al. 2021)."""
    return _share_below_acceptable(trajectory.scores[:, 0])


def q2_mean(trajectory: Trajectory) -> float:
    """Mean learned Q2 over the steps (Bachiller et al. 2021)."""
    return mean(trajectory.scores[:, 1])


def q2_minimum(trajectory: Trajectory) -> float:
    """Minimum learned Q2 over the steps (Bachiller et al. 2021)."""
    return extreme(np.min, trajectory.scores[:, 1])


def q2_share_below_acceptable(trajectory: Trajectory) -> float:
    """Share of steps with a learned Q2 below 0.4 (Bachiller et al. 2021)."""
    return _share_below_acceptable(trajectory.scores[:, 1])


def _share_below_acceptable(scores: FloatArray) -> float:
    """Share of scores below 0.4; NaN if a step has no score, since the share is then unknown."""
    return np.nan if np.isnan(scores).any() else mean(scores < ACCEPTABLE_SCORE)
