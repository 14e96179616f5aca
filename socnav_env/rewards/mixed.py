"""A weighted sum of several rewards."""

from __future__ import annotations

from collections.abc import Mapping

from socnav_env.rewards.base import Moment, Reward, Scorer


class MixedReward:
    """A weighted sum of rewards. The terms of the part NAME are called NAME.TERM.

    All parts that need scores share one scorer, so that a step is scored once.

    Args:
        parts: weight and reward of each part, by name

    Raises:
        ValueError: If there is no part, or parts have different scorers.
    """

    def __init__(self, parts: Mapping[str, tuple[float, Reward]]) -> None:
        if not parts:
            raise ValueError("a mix must have at least one reward, got none")
        self._parts = {name: reward for name, (_, reward) in parts.items()}
        self.scorer = _shared(self._parts)
        self.weights = {
            f"{name}.{term}": share * weight
            for name, (share, reward) in parts.items()
            for term, weight in reward.weights.items()
        }

    def terms(self, moment: Moment) -> dict[str, float]:
        """Return the terms of all parts."""
        return {
            f"{name}.{term}": value
            for name, reward in self._parts.items()
            for term, value in reward.terms(moment).items()
        }


def _shared(parts: Mapping[str, Reward]) -> Scorer | None:
    scorers = {id(reward.scorer): reward.scorer for reward in parts.values() if reward.scorer is not None}
    if len(scorers) > 1:
        names = ", ".join(scorer.name for scorer in scorers.values())
        raise ValueError(f"the rewards of a mix must share one scorer, got {names}")
    return next(iter(scorers.values()), None)
