"""Rewards from a network trained on people's scores."""

from __future__ import annotations

from collections.abc import Mapping

from socnav_env.rewards.base import Moment, Scorer, terminal_terms


class LearnedReward:
    """The learned score: Q2 - 1 for every second, and terminal terms for arriving and for touching something.

    Q2 alone is positive almost everywhere, so that its sum would reward a robot for staying away from its goal. Q2 - 1
    is never above zero: what remains of an episode costs something, or nothing, and arriving ends it.

    A collision ends it as well, so it must cost more than all that could have come instead. At worst that is Q2 = 0 in
    every step: social * time_limit for a learner to which the time limit is the end, and
    social * control_period / (1 - discount) for one that bootstraps there, to which an episode goes on for ever. Where
    -contact is above both, every way to go on without touching anything is better than touching something now, at every
    step, whatever the scene and the scores. With the default weights it is for every discount per step of 0.2 s up to
    0.997, the largest that the usual libraries default to, and without a discount for time limits up to 70 s.

    An episode that arrives is better than the same one that goes on to stand instead, at every discount. No weights
    can promise that of any drive to the goal, since a small discount hides what comes after a long way.

    Args:
        pessimism: standard deviations of the scorer's members that are subtracted from Q2, at most down to 0
    """

    def __init__(self, weights: Mapping[str, float], scorer: Scorer, pessimism: float = 0.0) -> None:
        self.weights = weights
        self.scorer = scorer
        self._pessimism = pessimism

    def terms(self, moment: Moment) -> dict[str, float]:
        """Return `social`, Q2 - 1 times the step's duration [s]; `arrival` and `contact`, 1 if they end the episode.

        Q2 is taken within 0..1, whatever the scorer.
        """
        q2 = min(max(_payable(moment, "q2", self._pessimism), 0.0), 1.0)
        return {"social": (q2 - 1.0) * moment.duration, **terminal_terms(moment)}


class RawScoreReward:
    """One of the network's raw scores, for comparison.

    Both are positive nearly everywhere, so that their sum rewards long episodes. Q1 ("the robot does not cause any
    disturbance to the humans in the room") does not depend on the goal.

    Args:
        weights: of the one term, by the score's name: "q1" or "q2"
        pessimism: as for `LearnedReward`
    """

    def __init__(self, weights: Mapping[str, float], scorer: Scorer, pessimism: float = 0.0) -> None:
        self.weights = weights
        self._pessimism = pessimism
        (self._score,) = weights
        self.scorer = scorer

    def terms(self, moment: Moment) -> dict[str, float]:
        """Return `q1` or `q2`, about 0..1."""
        return {self._score: _payable(moment, self._score, self._pessimism)}


def _payable(moment: Moment, question: str, pessimism: float) -> float:
    """The score that is paid for a question, "q1" or "q2"."""
    scores = moment.scores
    assert scores is not None, "a reward with a scorer is always given scores"
    score, deviation = (scores.q1, scores.q1_std) if question == "q1" else (scores.q2, scores.q2_std)
    return max(score - pessimism * deviation, 0.0) if pessimism else score
