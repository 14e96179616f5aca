"""`SocNavVectorEnv` as Stable-Baselines3 expects vector environments to be."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

import gymnasium as gym
import numpy as np
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from socnav_env.env import StepResult
from socnav_env.vector.env import SocNavVectorEnv


class SB3VectorEnv(VecEnv):
    """Many worlds in this process, for SB3's algorithms.

    Worlds whose episode has ended begin anew at once, as SB3 wants it: what was seen last is in
    `info["terminal_observation"]`, whether time was over in `info["TimeLimit.truncated"]`, and what `Monitor` would
    have noted in `info["episode"]`, in control steps and whatever the action repeat.

    Args:
        envs: the worlds.
        action_repeat: control steps each action lasts, at most to the end of the episode. Their rewards are added
            up, and `info["q2"]` is their mean.
        monitored: what else of the last info goes into `info["episode"]`.

    """

    def __init__(
        self, envs: SocNavVectorEnv, action_repeat: int = 1, monitored: tuple[str, ...] = ("is_success",)
    ) -> None:
        self.envs, self.action_repeat, self.monitored = envs, action_repeat, monitored
        self._actions: np.ndarray[Any, Any] = np.zeros(envs.action_space.shape or (), dtype=np.float32)
        self._returns = [0.0] * envs.num_envs
        self._lengths = [0] * envs.num_envs
        self._start = time.time()
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)

    def reset(self) -> VecEnvObs:
        """Begin an episode in every world and return what they see."""
        options = [each for each in self._options if each]
        if options:
            raise ValueError(f"reset has no options, got {options[0]}")
        self._begin(range(self.num_envs), self._seeds)
        self._reset_seeds()
        self._reset_options()
        return self._observations()

    def step_async(self, actions: np.ndarray[Any, Any]) -> None:
        """Keep the actions, (num_envs, 2), for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Let every action last its control steps: observations, rewards, dones and infos."""
        rewards, dones = np.zeros(self.num_envs, dtype=np.float32), np.zeros(self.num_envs, dtype=np.bool_)
        infos: list[dict[str, Any]] = [{}] * self.num_envs
        scores: list[list[float]] = [[] for _ in infos]
        running = list(range(self.num_envs))
        for _ in range(self.action_repeat):
            if not running:
                break
            for index, result in zip(running, self.envs.step_some(running, self._actions), strict=True):
                self._returns[index] += result.reward
                self._lengths[index] += 1
                rewards[index] += result.reward
                dones[index] = result.terminated or result.truncated
                infos[index] = self._info(index, result)
                if "q2" in result.info:
                    scores[index].append(result.info["q2"])
            running = [index for index in running if not dones[index]]
        for info, each in zip(infos, scores, strict=True):
            if each:
                info["q2"] = sum(each) / len(each)
        self._begin(np.flatnonzero(dones).tolist())
        return self._observations(), rewards, dones, infos

    def close(self) -> None:
        """Close the windows, if there are any."""
        self.envs.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute of each environment."""
        return [getattr(env, attr_name) for env in self._chosen(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of each environment."""
        for env in self._chosen(indices):
            setattr(env, attr_name, value)

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any) -> list[Any]:
        """Call a method of each environment."""
        return [getattr(env, method_name)(*method_args, **method_kwargs) for env in self._chosen(indices)]

    def env_is_wrapped(self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: Any = None) -> list[bool]:
        """Return whether each environment does what the wrapper does: `Monitor` alone, whose notes are taken here."""
        return [wrapper_class is Monitor for _ in self._chosen(indices)]

    def get_images(self) -> list[np.ndarray[Any, Any] | None]:
        """Return a picture of each world."""
        return list(self.envs.render())

    def _chosen(self, indices: Any) -> list[Any]:
        return [self.envs.envs[index] for index in self._get_indices(indices)]

    def _observations(self) -> VecEnvObs:
        observations: VecEnvObs = self.envs.observations()
        return observations

    def _begin(self, chosen: Iterable[int], seeds: list[int | None] | None = None) -> None:
        indices = list(chosen)
        for index, info in zip(indices, self.envs.reset_some(indices, seeds), strict=True):
            self.reset_infos[index] = info
            self._returns[index], self._lengths[index] = 0.0, 0

    def _info(self, index: int, result: StepResult) -> dict[str, Any]:
        info = result.info
        info["TimeLimit.truncated"] = result.truncated and not result.terminated
        if result.terminated or result.truncated:
            info["terminal_observation"] = self.envs.observation(index)
            info["episode"] = {
                "r": round(self._returns[index], 6),
                "l": self._lengths[index],
                "t": round(time.time() - self._start, 6),
                **{name: info[name] for name in self.monitored},
            }
        return info
