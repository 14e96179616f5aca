"""Rewards: objects that compute named terms, and the weights that sum them up.

Rewards keep no state, so one object serves any number of environments. A new one is a class, and a line in `REWARDS`.

May import `trajectories` and what that is built of.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from typing import TYPE_CHECKING

from socnav_env.config.checks import check_number
from socnav_env.rewards.base import Moment, Reward, Scorer, weighted_terms
from socnav_env.rewards.handcrafted import CrowdNavReward, DSRNNReward, SparseReward
from socnav_env.rewards.learned import LearnedReward, RawScoreReward
from socnav_env.rewards.mixed import MixedReward

if TYPE_CHECKING:
    from socnav_env.config.rewards import RewardConfig

__all__ = [
    "REWARDS",
    "CrowdNavReward",
    "DSRNNReward",
    "LearnedReward",
    "MixedReward",
    "Moment",
    "RawScoreReward",
    "Reward",
    "Scorer",
    "SparseReward",
    "make_reward",
    "shared_scorer",
    "weighted_terms",
]

MIX = "mix"


@cache
def shared_scorer(weights: str) -> Scorer:
    """Load the scorer of these weights ("default", "published" or a path), one per process."""
    from reward_model.scorer import load_scorer  # loads torch, which only learned rewards need

    return load_scorer(weights)


def _learned(config: RewardConfig, weights: str) -> Reward:
    terms = {"social": config.social, "arrival": config.arrival, "contact": config.contact}
    return LearnedReward(terms, shared_scorer(weights), config.pessimism)


def _q1(config: RewardConfig, weights: str) -> Reward:
    return RawScoreReward({"q1": config.score}, shared_scorer(weights), config.pessimism)


def _q2(config: RewardConfig, weights: str) -> Reward:
    return RawScoreReward({"q2": config.score}, shared_scorer(weights), config.pessimism)


def _crowdnav(config: RewardConfig, weights: str) -> Reward:
    terms = {
        "discomfort": config.crowdnav_discomfort,
        "arrival": config.crowdnav_arrival,
        "contact": config.crowdnav_contact,
    }
    return CrowdNavReward(terms, config.crowdnav_discomfort_distance)


def _dsrnn(config: RewardConfig, weights: str) -> Reward:
    terms = {
        "progress": config.dsrnn_progress,
        "discomfort": config.dsrnn_discomfort,
        "arrival": config.dsrnn_arrival,
        "contact": config.dsrnn_contact,
    }
    return DSRNNReward(terms, config.dsrnn_discomfort_distance)


def _sparse(config: RewardConfig, weights: str) -> Reward:
    return SparseReward({"arrival": config.sparse_arrival, "contact": config.sparse_contact})


def _mix(config: RewardConfig, weights: str) -> Reward:
    return _mixed(config.mix, config, weights)


REWARDS: dict[str, Callable[[RewardConfig, str], Reward]] = {
    "learned": _learned,
    "q1": _q1,
    "q2": _q2,
    "crowdnav": _crowdnav,
    "dsrnn": _dsrnn,
    "sparse": _sparse,
    MIX: _mix,
}


def make_reward(reward: str | Mapping[str, float] | Reward, config: RewardConfig, weights: str = "default") -> Reward:
    """Return the reward of this name, a mix, or the given one if it is a `Reward` already.

    Args:
        reward: a name; a mix as in "learned+0.5*crowdnav", or as in {"learned": 1.0, "crowdnav": 0.5}; or an object
        weights: the network of learned rewards, see `shared_scorer`

    Raises:
        ValueError: For an unknown name, an invalid mix, and an object that is not a reward.
    """
    if isinstance(reward, str):
        if reward in REWARDS:
            return REWARDS[reward](config, weights)
        return _mixed(_parts_of(reward), config, weights)
    if isinstance(reward, Mapping):
        return _mixed(reward.items(), config, weights)
    if not isinstance(reward, Reward):
        raise ValueError(
            f"reward must be one of {', '.join(REWARDS)} or an object with weights, scorer and terms(moment), "
            f"got {type(reward).__name__}"
        )
    return reward


def _mixed(parts: Iterable[tuple[str, float]], config: RewardConfig, weights: str) -> Reward:
    shares = dict(parts)
    valid = [name for name in REWARDS if name != MIX]
    for name, share in shares.items():
        if name not in valid:
            raise ValueError(f"a mix of rewards must be of {', '.join(valid)}, got {name!r}")
        check_number(f"the share of {name} in a mix of rewards", share, -math.inf, math.inf)
    return MixedReward({name: (share, REWARDS[name](config, weights)) for name, share in shares.items()})


def _parts_of(text: str) -> list[tuple[str, float]]:
    """Read a mix such as learned+0.5*crowdnav."""
    complaint = ValueError(
        f"reward must be one of {', '.join(REWARDS)} or a Reward object or a mix such as learned+0.5*crowdnav, "
        f"got {text!r}"
    )
    parts: dict[str, float] = {}
    for part in text.split("+"):
        share, star, name = part.rpartition("*")
        try:
            number = float(share) if star else 1.0
        except ValueError:
            raise complaint from None
        if name.strip() not in REWARDS or name.strip() in parts:
            raise complaint
        parts[name.strip()] = number
    return list(parts.items())
