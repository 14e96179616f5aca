"""Rewards from a network trained on people's scores."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from socnav_env.rewards.base import Moment, Scorer, terminal_terms

if TYPE_CHECKING:
    from reward_model.scenes.scene import Scores


class LearnedReward:
    """The learned score: Q2 - 1 every step, and terminal terms for arriving and for touching something.

    Q2 alone is positive almost everywhere, so that its sum would reward a robot for staying away from its goal.
    Q2 - 1 is never above zero, so that arriving always beats waiting.
    """

    def __init__(self, weights: Mapping[str, float], scorer: Scorer) -> None:
        self.weights = weights
        self.scorer = scorer

    def terms(self, moment: Moment) -> dict[str, float]:
        """Return `social`, Q2 - 1, at most 0; `arrival` and `contact`, 1 in the last step if they happen."""
        return {"social": min(_scores(moment).q2, 1.0) - 1.0, **terminal_terms(moment)}


class RawScoreReward:
    """One of the network's raw scores, for comparison.

    Both are positive nearly everywhere, so that their sum rewards long episodes. Q1 ("the robot does not cause any
    disturbance to the humans in the room") does not depend on the goal.

    Args:
        weights: of the one term, by the score's name: "q1" or "q2"
    """

    def __init__(self, weights: Mapping[str, float], scorer: Scorer) -> None:
        self.weights = weights
        (self._score,) = weights
        self.scorer = scorer

    def terms(self, moment: Moment) -> dict[str, float]:
        """Return `q1` or `q2`, about 0..1."""
        return {self._score: float(getattr(_scores(moment), self._score))}


def _scores(moment: Moment) -> Scores:
    assert moment.scores is not None, "a reward with a scorer is always given scores"
    return moment.scores
