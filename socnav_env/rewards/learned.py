"""Rewards from a network trained on people's scores."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from socnav_env.rewards.base import Moment, Scorer, terminal_terms

if TYPE_CHECKING:
    from reward_model.scenes.scene import Scores


class LearnedReward:
    """The learned score: Q2 - 1 for every second, and terminal terms for arriving and for touching something.

    Q2 alone is positive almost everywhere, so that its sum would reward a robot for staying away from its goal. Q2 - 1
    is never above zero: what remains of an episode costs something, or nothing, and arriving ends it.

    A collision ends it as well, so it must cost more than all that could have come instead. At worst that is Q2 = 0 in
    every step: social * time_limit for a learner to which the time limit is the end, and
    social * control_period / (1 - discount) for one that bootstraps there, to which an episode goes on for ever. Where
    -contact is above both, every way to go on without touching anything is better than touching something now, at every
    step, whatever the scene and the scores. With the default weights it is for every discount per step of 0.2 s below
    0.9992, and without a discount for time limits below 250 s.

    An episode that arrives is better than the same one that goes on to stand instead, at every discount. No weights
    can promise that of any drive to the goal, since a small discount hides what comes after a long way.
    """

    def __init__(self, weights: Mapping[str, float], scorer: Scorer) -> None:
        self.weights = weights
        self.scorer = scorer

    def terms(self, moment: Moment) -> dict[str, float]:
        """Return `social`, Q2 - 1 times the step's duration [s]; `arrival` and `contact`, 1 if they end the episode.

        Q2 is taken within 0..1, whatever the scorer.
        """
        q2 = min(max(_scores(moment).q2, 0.0), 1.0)
        return {"social": (q2 - 1.0) * moment.duration, **terminal_terms(moment)}


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
