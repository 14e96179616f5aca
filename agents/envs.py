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

    def side_by_side(self, num_envs: int, action_repeat: int) -> VecEnv:
        """Return many in this process, whose rewards are scored many at a time."""
        from agents.vector import SB3VectorEnv
        from socnav_env.vector.env import SocNavVectorEnv

        return SB3VectorEnv(SocNavVectorEnv(num_envs, **self._arguments()), action_repeat, MONITORED)

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


class RepeatedAction(gym.Wrapper[Any, Any, Any, Any]):
    """Takes every action for several control steps and adds up their rewards.

    The robot is slow: what a single action of 0.2 s explores drowns in the next one's noise. `info["q2"]` is the
    mean over the steps.
    """

    def __init__(self, env: gym.Env[Any, Any], times: int) -> None:
        super().__init__(env)
        self.times = times

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Take the action until the time is over or the episode ends."""
        total, scores = 0.0, []
        for _ in range(self.times):
            observation, reward, terminated, truncated, info = self.env.step(action)
            total += float(reward)
            if "q2" in info:
                scores.append(info["q2"])
            if terminated or truncated:
                break
        if scores:
            info["q2"] = sum(scores) / len(scores)
        return observation, total, terminated, truncated, info


@dataclass(frozen=True)
class TrainingMaker:
    """Makes one training environment, with what SB3 logs at the end of an episode."""

    make: EnvironmentMaker
    action_repeat: int

    def __call__(self) -> gym.Env[Any, Any]:
        """Return a new environment."""
        return RepeatedAction(Monitor(self.make(), info_keywords=MONITORED), self.action_repeat)


@dataclass(frozen=True)
class PartMaker:
    """Makes the training environments of one process."""

    make: EnvironmentMaker
    action_repeat: int

    def __call__(self, num_envs: int) -> VecEnv:
        """Return `num_envs` of them."""
        if isinstance(self.make, SocNavMaker):
            return self.make.side_by_side(num_envs, self.action_repeat)
        return DummyVecEnv([TrainingMaker(self.make, self.action_repeat)] * num_envs)


def make_training_envs(make: EnvironmentMaker, num_envs: int, num_workers: int, action_repeat: int = 1) -> VecEnv:
    """Return environments that run side by side.

    Args:
        make: makes one of them.
        num_envs: how many.
        num_workers: processes they are spread over; 0 runs them in this one.
        action_repeat: control steps each action lasts.

    """
    part = PartMaker(make, action_repeat)
    if num_workers == 0:
        return part(num_envs)
    return WorkerVecEnv(part, num_envs, min(num_workers, num_envs))
