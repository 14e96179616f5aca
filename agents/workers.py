"""Environments spread over a few processes, several in each.

SB3's `SubprocVecEnv` runs one process per environment and exchanges one message per environment and step. With
more environments than cores that is mostly overhead; here a step costs one message per process.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from socnav_env.vector.worker_pool import WorkerPool

VecEnvMaker = Callable[[int], VecEnv]
"""Returns a vector environment of as many environments as it is told. Can be pickled to another process."""


class WorkerVecEnv(VecEnv):
    """SB3's vector environment over `num_workers` processes.

    The observation is a Dict of Boxes. An error in a worker is raised here.

    Args:
        make: makes the part of one process.
        num_envs: how many environments.
        num_workers: how many processes share them, as evenly as can be.

    """

    def __init__(self, make: VecEnvMaker, num_envs: int, num_workers: int) -> None:
        shares = np.array_split(np.arange(num_envs), num_workers)
        self._slices = [slice(int(share[0]), int(share[-1]) + 1) for share in shares]
        self._pool = WorkerPool([partial(_Part, make, part.stop - part.start) for part in self._slices])
        observation_space, action_space = self._pool.ask(0, "spaces")
        super().__init__(num_envs, observation_space, action_space)

    def reset(self) -> VecEnvObs:
        """Reset all environments and return their first observations."""
        answers = self._pool.ask_all("reset", [(self._seeds[part], self._options[part]) for part in self._slices])
        self.reset_infos = [info for _, infos in answers for info in infos]
        self._reset_seeds()
        self._reset_options()
        return _join([observations for observations, _ in answers])

    def step_async(self, actions: np.ndarray[Any, Any]) -> None:
        """Send every worker the actions of its environments."""
        self._pool.tell_all("step", [(actions[part],) for part in self._slices])

    def step_wait(self) -> VecEnvStepReturn:
        """Gather what the workers answer: observations, rewards, dones and infos."""
        observations, rewards, dones, infos, reset_infos = zip(*self._pool.answers(), strict=True)
        self.reset_infos = [info for part in reset_infos for info in part]
        return (
            _join(observations),
            np.concatenate(rewards),
            np.concatenate(dones),
            [info for part in infos for info in part],
        )

    def close(self) -> None:
        """End the workers."""
        self._pool.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute of each environment."""
        return self._ask_each("get_attr", indices, attr_name)

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of each environment."""
        self._ask_each("set_attr", indices, attr_name, value)

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any) -> list[Any]:
        """Call a method of each environment."""
        return self._ask_each("env_method", indices, method_name, *method_args, **method_kwargs)

    def env_is_wrapped(self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: Any = None) -> list[bool]:
        """Return whether each environment is wrapped in `wrapper_class`."""
        return self._ask_each("env_is_wrapped", indices, wrapper_class)

    def _ask_each(self, method: str, indices: Any, *args: Any, **kwargs: Any) -> list[Any]:
        wanted = list(self._get_indices(indices)) if indices is not None else None
        answers: list[Any] = []
        for worker, part in enumerate(self._slices):
            own = [i - part.start for i in range(part.start, part.stop) if wanted is None or i in wanted]
            if own:
                answers.extend(self._pool.ask(worker, "call", method, args, {**kwargs, "indices": own}) or ())
        return answers


class _Part:
    """The environments of one process."""

    def __init__(self, make: VecEnvMaker, num_envs: int) -> None:
        self._envs = make(num_envs)

    def spaces(self) -> tuple[gym.Space[Any], gym.Space[Any]]:
        return self._envs.observation_space, self._envs.action_space

    def reset(self, seeds: list[int | None], options: list[dict[str, Any]]) -> tuple[VecEnvObs, list[dict[str, Any]]]:
        self._envs._seeds, self._envs._options = seeds, options
        return self._envs.reset(), self._envs.reset_infos

    def step(self, actions: np.ndarray[Any, Any]) -> tuple[Any, ...]:
        return *self._envs.step(actions), self._envs.reset_infos

    def call(self, method: str, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
        return getattr(self._envs, method)(*args, **kwargs)

    def close(self) -> None:
        self._envs.close()


def _join(parts: Sequence[Any]) -> dict[str, np.ndarray[Any, Any]]:
    assert isinstance(parts[0], dict), "the observation space is a Dict"
    return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
