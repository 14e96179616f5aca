"""What a user can set about rewards: the weights of their named terms."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

from socnav_env.checks import ConfigError, check_number

Mix = tuple[tuple[str, float], ...]  # rewards by name, and how much of each


@dataclass(frozen=True)
class RewardConfig:
    """Weights of the named reward terms.

    social: of Q2 - 1 (or the raw Q1 or Q2) each step, arrival and contact: once, at the end; for the learned rewards
    crowdnav_*: Chen et al. 2019: arrival, contact, and discomfort within a surface distance [m], by the second
    dsrnn_*: Liu et al. 2021: progress [1/m], arrival, contact, and discomfort likewise; they pay 2.5 for each metre
        too close and step of 0.25 s
    mix: what the reward "mix" is made of: names and how much of each
    """

    social: float = 1.0
    arrival: float = 50.0
    contact: float = -50.0
    crowdnav_arrival: float = 1.0
    crowdnav_contact: float = -0.25
    crowdnav_discomfort: float = 0.5
    crowdnav_discomfort_distance: float = 0.2
    dsrnn_progress: float = 2.0
    dsrnn_arrival: float = 10.0
    dsrnn_contact: float = -20.0
    dsrnn_discomfort: float = 10.0
    dsrnn_discomfort_distance: float = 0.25
    mix: Mix = (("learned", 1.0), ("crowdnav", 1.0))

    def __post_init__(self) -> None:
        for each in dataclasses.fields(self):
            if each.name == "mix":
                continue
            least = 0 if each.name.endswith("_distance") else -math.inf
            check_number(f"reward.{each.name}", getattr(self, each.name), least, math.inf)
        _check_mix(self.mix)


def _check_mix(mix: object) -> None:
    """Refuse what is not names, each once, with numbers. Which names there are is known to `socnav_env.rewards`."""
    pairs = mix if isinstance(mix, tuple) and mix else ((),)
    for pair in pairs:
        if not (isinstance(pair, tuple) and len(pair) == 2 and isinstance(pair[0], str)):
            raise ConfigError(f'reward.mix must be pairs such as (("learned", 1.0), ("crowdnav", 0.5)), got {mix!r}')
        check_number(f"reward.mix: {pair[0]}", pair[1], -math.inf, math.inf)
    names = [pair[0] for pair in pairs]
    if len(set(names)) < len(names):
        raise ConfigError(f"reward.mix must name each reward once, got {', '.join(names)}")
