"""The reward protocol: a reward reads one `Moment` and returns unweighted terms by name; weights sum them up."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from socnav_env.trajectories.outcomes import Outcome

if TYPE_CHECKING:
    from collections.abc import Sequence

    from reward_model.graph.frame import FrameGraph
    from reward_model.scenes.scene import Scores
    from socnav_env.simulation.world import World


@dataclass(frozen=True, slots=True)
class Moment:
    """The result of a step.

    Attributes:
        world: after the step, read-only
        duration: [s] of the step
        progress: [m] by which the robot has come closer to its goal, negative if it has moved away
        outcome: of the episode in this step, None if it goes on
        scores: learned scores of the last second; None if the reward has no scorer
    """

    world: World
    duration: float
    progress: float
    outcome: Outcome | None
    scores: Scores | None


class Scorer(Protocol):
    """Scores windows of up to three frames, newest first. `reward_model`'s `SocialScorer` is one."""

    @property
    def name(self) -> str:
        """The name of the weights."""

    def score_windows(self, windows: Sequence[Sequence[FrameGraph]]) -> NDArray[np.float32]:
        """Return (num_windows, 2) q1 and q2."""


@runtime_checkable
class Reward(Protocol):
    """The protocol of a reward; any object that has it can be given to `gym.make(..., reward=)`."""

    @property
    def weights(self) -> Mapping[str, float]:
        """The weight of each term, by its name."""

    @property
    def scorer(self) -> Scorer | None:
        """The scorer of `Moment.scores`; None if the reward needs no scores."""

    def terms(self, moment: Moment) -> dict[str, float]:
        """Return the unweighted terms: the same names every step, each with a weight."""


def weighted_terms(reward: Reward, moment: Moment) -> dict[str, float]:
    """Return each term's contribution; their sum is the reward of the step.

    Raises:
        ValueError: For a term without a weight.
    """
    weights = reward.weights
    try:
        return {name: weights[name] * value for name, value in reward.terms(moment).items()}
    except KeyError as error:
        raise ValueError(f"reward term {error} needs a weight, weights are {', '.join(weights)}") from None


def terminal_terms(moment: Moment) -> dict[str, float]:
    """Return `arrival` and `contact`, 1 in the last step if they happen, else 0."""
    outcome = moment.outcome
    return {
        "arrival": float(outcome is Outcome.ARRIVED),
        "contact": float(outcome is not None and outcome.is_collision),
    }
