"""Gymnasium's vector environments as Stable-Baselines3 expects vector environments to be."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from socnav_env.vector.infos import split_infos


class SB3VecEnv(VecEnv):
    """A Gymnasium vector environment for SB3's algorithms, e.g. one from `gym.make_vec("SocNav2-v0", ...)`.

    An episode that ends begins anew at once, as SB3 wants it: `info["terminal_observation"]` has its last observation,
    `info["TimeLimit.truncated"]` whether it was cut off, and `info["episode"]` what `Monitor` would note, in control
    steps whatever the action repeat.

    Args:
        envs: in the autoreset mode `SAME_STEP`.
        monitored: keys of the last info that go into `info["episode"]`.

    Raises:
        ValueError: for another autoreset mode.
    """

    def __init__(self, envs: VectorEnv[Any, Any, Any], monitored: Sequence[str] = ("is_success",)) -> None:
        mode = envs.metadata.get("autoreset_mode")
        if mode is not AutoresetMode.SAME_STEP:
            raise ValueError(f"autoreset_mode must be {AutoresetMode.SAME_STEP.value}, got {mode}")
        self.envs, self.monitored = envs, tuple(monitored)
        self._actions: NDArray[Any] = np.zeros(envs.action_space.shape or (), dtype=np.float32)
        self._returns = np.zeros(envs.num_envs)
        self._lengths = np.zeros(envs.num_envs, dtype=np.int64)
        self._start = time.time()
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)

    def reset(self) -> VecEnvObs:
        """Begin an episode in every world and return the first observations."""
        observations: VecEnvObs
        options = [each for each in self._options if each]
        if options:
            raise ValueError(f"reset has no options, got {options[0]}")
        seeds: Any = list(self._seeds)
        observations, infos = self.envs.reset(seed=seeds)
        self.reset_infos = split_infos(infos, self.num_envs)
        self._returns[:], self._lengths[:] = 0.0, 0
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep the actions, a row each, for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Take the actions: observations, rewards, dones and infos."""
        observations, rewards, terminations, truncations, batch = self.envs.step(self._actions)
        infos = split_infos(batch, self.num_envs)
        dones = terminations | truncations
        for index in np.flatnonzero(dones).tolist():
            infos[index] = self._ended(index, infos[index])
        self._returns += rewards
        for index, info in enumerate(infos):
            self._lengths[index] += info.get("control_steps", 1)
            info["TimeLimit.truncated"] = bool(truncations[index] and not terminations[index])
            if dones[index]:
                info["episode"] = self._episode(index, info)
        self._returns[dones], self._lengths[dones] = 0.0, 0
        return observations, rewards.astype(np.float32), dones, infos

    def close(self) -> None:
        """Close the windows and end the processes, if there are any."""
        self.envs.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute of each environment."""
        values = self.envs.get_attr(attr_name)  # type: ignore[attr-defined]  # every vector environment has it
        return [values[index] for index in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of each environment."""
        chosen = list(self._get_indices(indices))
        everywhere = len(chosen) == self.num_envs
        values = [value] * self.num_envs if everywhere else self.get_attr(attr_name)
        for index in chosen:
            values[index] = value
        self.envs.set_attr(attr_name, values)  # type: ignore[attr-defined]  # likewise

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any) -> list[Any]:
        """Call a method of each environment, or of one that the vector environment can call alone."""
        chosen = list(self._get_indices(indices))
        if len(chosen) == self.num_envs:
            return list(self.envs.call(method_name, *method_args, **method_kwargs))  # type: ignore[attr-defined]
        call_some: Callable[..., Sequence[Any]] | None = getattr(self.envs, "call_some", None)
        if call_some is None:
            raise ValueError(f"indices must name all {self.num_envs} environments here, got {chosen}")
        return list(call_some(chosen, method_name, *method_args, **method_kwargs))

    def env_is_wrapped(self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: Any = None) -> list[bool]:
        """Return whether each environment does what the wrapper does: `Monitor` alone, whose notes are taken here."""
        return [wrapper_class is Monitor for _ in self._get_indices(indices)]

    def get_images(self) -> list[NDArray[Any] | None]:
        """Return a picture of each world."""
        pictures: Any = self.envs.render() or ()
        return list(pictures)

    def _ended(self, index: int, info: dict[str, Any]) -> dict[str, Any]:
        """The info of an episode's last step; that of the reset which followed is kept."""
        last: dict[str, Any] = info.pop("final_info")
        last["terminal_observation"] = info.pop("final_obs")
        self.reset_infos[index] = info
        return last

    def _episode(self, index: int, info: dict[str, Any]) -> dict[str, Any]:
        return {
            "r": round(float(self._returns[index]), 6),
            "l": int(self._lengths[index]),
            "t": round(time.time() - self._start, 6),
            **{name: info[name] for name in self.monitored},
        }
