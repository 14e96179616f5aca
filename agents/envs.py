"""The one place that makes environments: one for an episode to watch, many for training."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import gymnasium as gym
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv

from agents.workers import WorkerVecEnv

EnvironmentMaker = Callable[..., gym.Env[Any, Any]]
"""Returns a new environment. Takes `render_mode` by name and can be pickled to another process."""

MONITORED = ("is_success",)


@dataclass(frozen=True)
class SocNavMaker:
    """Makes `SocNav2-v0` with the `entities` observation.

    reward: the reward's name
    weights: which weights a learned reward uses
    config: where `EnvConfig` differs from the default, as `EnvConfig.from_dict` reads it
    """

    reward: str = "learned"
    weights: str = "default"
    config: dict[str, Any] = field(default_factory=dict)

    def __call__(self, render_mode: str | None = None) -> gym.Env[Any, Any]:
        """Return a new environment."""
        import socnav_env  # noqa: F401 registers SocNav2-v0
        from socnav_env.config import EnvConfig

        return gym.make(
            "SocNav2-v0",
            disable_env_checker=True,  # it would check every step; the environment's own tests do
            reward=self.reward,
            observation="entities",
            weights=self.weights,
            config=EnvConfig.from_dict(self.config),
            render_mode=render_mode,
        )


@dataclass(frozen=True)
class MonitoredMaker:
    """Makes one training environment, with what SB3 logs at the end of an episode."""

    make: EnvironmentMaker

    def __call__(self) -> gym.Env[Any, Any]:
        """Return a new environment."""
        return Monitor(self.make(), info_keywords=MONITORED)


def make_training_envs(make: EnvironmentMaker, num_envs: int, num_workers: int) -> VecEnv:
    """Return environments that run side by side.

    Args:
        make: makes one of them.
        num_envs: how many.
        num_workers: processes they are spread over; 0 runs them in this one.

    """
    makers: list[Callable[[], gym.Env[Any, Any]]] = [MonitoredMaker(make)] * num_envs
    if num_workers == 0:
        return DummyVecEnv(makers)
    return WorkerVecEnv(makers, min(num_workers, num_envs))
