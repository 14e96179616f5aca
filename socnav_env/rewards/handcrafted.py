"""Handcrafted rewards."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from socnav_env.rewards.base import Moment, terminal_terms


class CrowdNavReward:
    """Chen et al. 2019, "Crowd-Robot Interaction": the handcrafted reward that most later work builds on.

    With its weights: 1 for arriving, -0.25 for a collision (in the paper with a person, here with anything), and
    0.5 * (d - 0.2) * dt in any other step that ends with the closest person's surface d < 0.2 m away.

    Args:
        discomfort_distance: [m] between surfaces
    """

    scorer = None

    def __init__(self, weights: Mapping[str, float], discomfort_distance: float) -> None:
        self.weights = weights
        self._discomfort_distance = discomfort_distance

    def terms(self, moment: Moment) -> dict[str, float]:
        """Return `discomfort`, [m s] and at most 0; `arrival` and `contact`, 1 in the last step if they happen."""
        terminal = terminal_terms(moment)
        discomfort = 0.0 if any(terminal.values()) else _discomfort(moment, self._discomfort_distance)
        return {"discomfort": discomfort, **terminal}


class DSRNNReward:
    """Liu et al. 2021, "Decentralized Structural-RNN for Robot Crowd Navigation with Deep Reinforcement Learning".

    With its weights: 10 for arriving, -20 for a collision (in the paper with a person, here with anything);
    10 * (d - 0.25) * dt in any other step that ends with the closest person's surface d < 0.25 m away
    (2.5 * (d - 0.25) in the paper's steps of 0.25 s); and in all other steps 2 for each metre that the robot has come
    closer to its goal.

    Args:
        discomfort_distance: [m] between surfaces
    """

    scorer = None

    def __init__(self, weights: Mapping[str, float], discomfort_distance: float) -> None:
        self.weights = weights
        self._discomfort_distance = discomfort_distance

    def terms(self, moment: Moment) -> dict[str, float]:
        """Return the one term that applies; the others are 0.

        `progress` [m], negative if the robot has moved away; `discomfort`, [m s] and at most 0; `arrival` and
        `contact`, 1 in the last step if they happen.
        """
        terminal = terminal_terms(moment)
        ended = any(terminal.values())
        discomfort = 0.0 if ended else _discomfort(moment, self._discomfort_distance)
        progress = 0.0 if ended or discomfort < 0 else moment.progress
        return {"progress": progress, "discomfort": discomfort, **terminal}


class SparseReward:
    """Terminal terms alone: arriving and touching something."""

    scorer = None

    def __init__(self, weights: Mapping[str, float]) -> None:
        self.weights = weights

    def terms(self, moment: Moment) -> dict[str, float]:
        """Return `arrival` and `contact`, 1 in the last step if they happen."""
        return terminal_terms(moment)


def _discomfort(moment: Moment, distance: float) -> float:
    """Distance to the closest person minus `distance` [m], times the step's duration; at most 0 [m s]."""
    closest = float(np.min(moment.world.clearance_to_people(), initial=np.inf))
    return min(closest - distance, 0.0) * moment.duration
