"""The one place that makes environments: one for an episode to watch, many for training."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import gymnasium as gym
from gymnasium.vector import VectorEnv

if TYPE_CHECKING:
    from agents.vector import SB3VecEnv

MONITORED = ("is_success",)


class EnvironmentMaker(Protocol):
    """Makes environments, and can be pickled to another process."""

    def __call__(self, render_mode: str | None = None) -> gym.Env[Any, Any]:
        """Return a new environment."""
        ...

    def vector(self, num_envs: int, num_workers: int, action_repeat: int) -> VectorEnv[Any, Any, Any]:
        """Return many side by side, which begin anew in the step that ends an episode.

        Args:
            num_envs: how many.
            num_workers: processes they are spread over; 0 runs them in this one.
            action_repeat: control steps each action lasts.
        """
        ...


@dataclass(frozen=True)
class SocNavMaker:
    """Makes `SocNav2-v0` with the `entities` observation.

    Attributes:
        reward: the reward's name
        weights: which weights a learned reward uses
        config: where `EnvConfig` differs from the default, as `EnvConfig.from_dict` reads it
        scenario: by name or file; None for rooms and people drawn at random
    """

    reward: str = "learned"
    weights: str = "default"
    config: dict[str, Any] = field(default_factory=dict)
    scenario: str | None = None

    def __call__(self, render_mode: str | None = None) -> gym.Env[Any, Any]:
        """Return a new environment."""
        import socnav_env  # noqa: F401 registers SocNav2-v0

        # The checker would check every step; the environment's own tests do.
        return gym.make("SocNav2-v0", disable_env_checker=True, render_mode=render_mode, **self._arguments())

    def vector(self, num_envs: int, num_workers: int, action_repeat: int) -> VectorEnv[Any, Any, Any]:
        """Return many whose rewards are scored many at a time; see `EnvironmentMaker`."""
        import socnav_env  # noqa: F401 registers SocNav2-v0

        return gym.make_vec(
            "SocNav2-v0",
            num_envs,
            vectorization_mode="vector_entry_point",
            num_workers=min(num_workers, num_envs) or None,
            action_repeat=action_repeat,
            autoreset_mode="SameStep",
            **self._arguments(),
        )

    def _arguments(self) -> dict[str, Any]:
        from socnav_env.config import EnvConfig

        config = EnvConfig.from_dict(self.config)
        return {
            "reward": self.reward,
            "observation": "entities",
            "weights": self.weights,
            "config": config,
            "scenario": self.scenario,
        }


def make_training_envs(make: EnvironmentMaker, num_envs: int, num_workers: int, action_repeat: int = 1) -> SB3VecEnv:
    """Return environments that run side by side, for Stable-Baselines3; see `EnvironmentMaker.vector`."""
    from agents.vector import SB3VecEnv

    return SB3VecEnv(make.vector(num_envs, num_workers, action_repeat), MONITORED)
