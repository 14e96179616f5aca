"""What a step is worth: small objects that name and measure terms, and the weights that add them up.

A reward sees one `Moment` and returns unweighted terms by name. Rewards keep no state, so one object serves any
number of environments. A new one is a class and a line in `REWARDS`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from socnav_env.outcomes import Outcome

if TYPE_CHECKING:
    from collections.abc import Sequence

    from reward_model.graph import FrameGraph
    from reward_model.scenario import Scores
    from socnav_env.config import RewardConfig
    from socnav_env.world import World


@dataclass(frozen=True, slots=True)
class Moment:
    """What a step led to.

    world: as it is after the step, to be asked and not changed
    duration: [s] of the step
    progress: [m] by which the robot has come closer to its goal, negative where it has moved away
    outcome: how the episode ended with this step, None if it goes on
    scores: what people would say of the last second; None where the reward has no scorer
    """

    world: World
    duration: float
    progress: float
    outcome: Outcome | None
    scores: Scores | None


class Scorer(Protocol):
    """Judges windows of up to three frames, newest first. `reward_model`'s `SocialScorer` is one."""

    @property
    def name(self) -> str:
        """Which weights these are."""

    def score_windows(self, windows: Sequence[Sequence[FrameGraph]]) -> NDArray[np.float32]:
        """Return (num_windows, 2) q1 and q2."""


@runtime_checkable
class Reward(Protocol):
    """What a reward has to offer; any object that does can be given to `gym.make(..., reward=)`."""

    @property
    def weights(self) -> Mapping[str, float]:
        """The factor of each term, by its name."""

    @property
    def scorer(self) -> Scorer | None:
        """Who fills in `Moment.scores`; None where the reward does not ask for any."""

    def terms(self, moment: Moment) -> dict[str, float]:
        """Return the unweighted terms, the same names every step, all of which have a weight."""


class LearnedReward:
    """What people find acceptable: Q2 - 1 every step, and terminal terms for arriving and for touching something.

    Q2 alone is positive almost everywhere, so that its sum would pay a robot for staying away from its goal.
    Less one (and never above zero), arriving always beats loitering.
    """

    def __init__(self, weights: Mapping[str, float], scorer: Scorer) -> None:
        self.weights = weights
        self.scorer = scorer

    def terms(self, moment: Moment) -> dict[str, float]:
        """Return `social`, Q2 - 1, at most 0; `arrival` and `contact`, 1 in the last step where they happen."""
        return {"social": min(_scores(moment).q2, 1.0) - 1.0, **_terminal_terms(moment)}


class RawScoreReward:
    """The network's Q2 as it is. Positive nearly everywhere, so its sum pays for taking long; here to be compared."""

    def __init__(self, weights: Mapping[str, float], scorer: Scorer) -> None:
        self.weights = weights
        self.scorer = scorer

    def terms(self, moment: Moment) -> dict[str, float]:
        """Return `q2`, about 0..1."""
        return {"q2": _scores(moment).q2}


class CrowdNavReward:
    """Chen et al. 2019, "Crowd-Robot Interaction": the handcrafted reward that most later work builds on.

    By its weights 1 for arriving, -0.25 for a collision (there with a person, here with anything), and
    0.5 * (d - 0.2) * dt in any other step that ends with the closest person's surface d < 0.2 m away.

    discomfort_distance: [m] between surfaces
    """

    scorer = None

    def __init__(self, weights: Mapping[str, float], discomfort_distance: float) -> None:
        self.weights = weights
        self._discomfort_distance = discomfort_distance

    def terms(self, moment: Moment) -> dict[str, float]:
        """Return `discomfort`, [m s] and at most 0; `arrival` and `contact`, 1 in the last step where they happen."""
        terminal = _terminal_terms(moment)
        discomfort = 0.0
        if not any(terminal.values()):
            closest = float(np.min(moment.world.clearance_to_people(), initial=np.inf))
            discomfort = min(closest - self._discomfort_distance, 0.0) * moment.duration
        return {"discomfort": discomfort, **terminal}


class SparseReward:
    """Only how the episode ends: arriving and touching something."""

    scorer = None

    def __init__(self, weights: Mapping[str, float]) -> None:
        self.weights = weights

    def terms(self, moment: Moment) -> dict[str, float]:
        """Return `arrival` and `contact`, 1 in the last step where they happen."""
        return _terminal_terms(moment)


@cache
def shared_scorer(weights: str) -> Scorer:
    """Load the scorer of these weights ("default", "published" or a path), one for the whole process."""
    from reward_model.scorer import load_scorer  # loads torch, which only learned rewards need

    return load_scorer(weights)


def _learned(config: RewardConfig, weights: str) -> Reward:
    terms = {"social": config.social, "arrival": config.arrival, "contact": config.contact}
    return LearnedReward(terms, shared_scorer(weights))


def _q2(config: RewardConfig, weights: str) -> Reward:
    return RawScoreReward({"q2": config.social}, shared_scorer(weights))


def _crowdnav(config: RewardConfig, weights: str) -> Reward:
    terms = {
        "discomfort": config.crowdnav_discomfort,
        "arrival": config.crowdnav_arrival,
        "contact": config.crowdnav_contact,
    }
    return CrowdNavReward(terms, config.crowdnav_discomfort_distance)


def _sparse(config: RewardConfig, weights: str) -> Reward:
    return SparseReward({"arrival": config.arrival, "contact": config.contact})


REWARDS: dict[str, Callable[[RewardConfig, str], Reward]] = {
    "learned": _learned,
    "q2": _q2,
    "crowdnav": _crowdnav,
    "sparse": _sparse,
}


def make_reward(reward: str | Reward, config: RewardConfig, weights: str = "default") -> Reward:
    """Return the reward of this name, or the given one if it is a `Reward` already.

    weights: which network learned rewards use.
    Raises `ValueError` for a name that nobody goes by and for an object that is not a reward.
    """
    if isinstance(reward, str):
        if reward not in REWARDS:
            raise ValueError(f"reward must be one of {', '.join(REWARDS)} or a Reward object, got {reward!r}")
        return REWARDS[reward](config, weights)
    if not isinstance(reward, Reward):
        raise ValueError(
            f"reward must be one of {', '.join(REWARDS)} or an object with weights, scorer and terms(moment), "
            f"got {type(reward).__name__}"
        )
    return reward


def weighted_terms(reward: Reward, moment: Moment) -> dict[str, float]:
    """Return each term's contribution, which together are the reward of the step.

    Raises `ValueError` for a term without a weight.
    """
    weights = reward.weights
    try:
        return {name: weights[name] * value for name, value in reward.terms(moment).items()}
    except KeyError as error:
        raise ValueError(f"reward term {error} needs a weight, weights are {', '.join(weights)}") from None


def _scores(moment: Moment) -> Scores:
    assert moment.scores is not None, "a reward with a scorer is always given scores"
    return moment.scores


def _terminal_terms(moment: Moment) -> dict[str, float]:
    outcome = moment.outcome
    return {
        "arrival": float(outcome is Outcome.ARRIVED),
        "contact": float(outcome is not None and outcome.is_collision),
    }
