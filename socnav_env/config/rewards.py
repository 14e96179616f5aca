"""Configuration of the rewards: the weights of their named terms, and how learned scores are made."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Final

from socnav_env.config.checks import ConfigError, check_number

Mix = tuple[tuple[str, float], ...]  # names of rewards and their weights

_LEAST: Final = {"time_scale": 1, "pessimism": 0}  # values of numbers that have a bound


@dataclass(frozen=True)
class RewardConfig:
    """Weights of the named reward terms, and how learned scores are made.

    Attributes:
        time_scale: factor, at least 1, by which a scene is slowed before it is scored, so that a fast robot is judged
            like those that people rated; see `RobotConfig.rated_time_scale`
        social: [1/s] weight of Q2 - 1 in `learned`, every step
        score: weight of the raw score in `q1` and `q2`, every step
        arrival, contact: weight of arriving and of touching something in `learned`, once, at the end; `LearnedReward`
            says how they must compare with `social`
        sparse_arrival, sparse_contact: the same in `sparse`
        crowdnav_arrival, crowdnav_contact: the same in `crowdnav` (Chen et al. 2019)
        crowdnav_discomfort: [1/(m s)] weight of each step that ends too close to a person
        crowdnav_discomfort_distance: [m] between surfaces, below which a step is too close
        dsrnn_progress: [1/m] weight of progress towards the goal in `dsrnn` (Liu et al. 2021)
        dsrnn_arrival, dsrnn_contact: weight of arriving and of touching something, once, at the end
        dsrnn_discomfort: [1/(m s)] weight of each step that ends too close to a person; theirs is 2.5 in a step of 0.25
            s
        dsrnn_discomfort_distance: [m] between surfaces, below which a step is too close
        pessimism: standard deviations of an ensemble's members that are subtracted from its scores before they pay
        mix: names and weights of the rewards in the reward `mix`
    """

    time_scale: float = 1.0
    social: float = 1.0
    score: float = 1.0
    arrival: float = 50.0
    contact: float = -70.0
    sparse_arrival: float = 50.0
    sparse_contact: float = -50.0
    crowdnav_arrival: float = 1.0
    crowdnav_contact: float = -0.25
    crowdnav_discomfort: float = 0.5
    crowdnav_discomfort_distance: float = 0.2
    dsrnn_progress: float = 2.0
    dsrnn_arrival: float = 10.0
    dsrnn_contact: float = -20.0
    dsrnn_discomfort: float = 10.0
    dsrnn_discomfort_distance: float = 0.25
    pessimism: float = 0.0
    mix: Mix = (("learned", 1.0), ("crowdnav", 1.0))

    def __post_init__(self) -> None:
        for each in dataclasses.fields(self):
            if each.name == "mix":
                continue
            least = _LEAST.get(each.name, 0 if each.name.endswith("_distance") else -math.inf)
            check_number(f"reward.{each.name}", getattr(self, each.name), least, math.inf)
        _check_mix(self.mix)


def _check_mix(mix: object) -> None:
    """Refuse a mix that is not pairs of names, each once, and numbers. `socnav_env.rewards` knows the valid names."""
    pairs = mix if isinstance(mix, tuple) and mix else ((),)
    for pair in pairs:
        if not (isinstance(pair, tuple) and len(pair) == 2 and isinstance(pair[0], str)):
            raise ConfigError(f'reward.mix must be pairs such as (("learned", 1.0), ("crowdnav", 0.5)), got {mix!r}')
        check_number(f"reward.mix: {pair[0]}", pair[1], -math.inf, math.inf)
    names = [pair[0] for pair in pairs]
    if len(set(names)) < len(names):
        raise ConfigError(f"reward.mix must name each reward once, got {', '.join(names)}")
