"""`SocNavVectorEnv`, the environment behind `gym.make_vec("SocNav2-v0")`: many worlds, judged together."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from typing import Any, Protocol

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space, concatenate, create_empty_array
from numpy.typing import ArrayLike, NDArray

from reward_model.base.arrays import BoolArray, FloatArray
from reward_model.scenes.scene import Scores
from socnav_env.env import SocNavEnv, StepResult, check_options
from socnav_env.observations import RowObservation
from socnav_env.rewards.judging import judge_all
from socnav_env.vector.arguments import Seeds, autoreset_mode_of, commands_of, named_by, seeds_of, values_for
from socnav_env.vector.infos import batch_infos, merged_infos


class SocNavVectorEnv(VectorEnv[Any, NDArray[np.float32], NDArray[Any]]):
    """Many worlds of `SocNav2-v0` in one process, whose rewards are scored many at a time.

    Every world goes the way that a `SocNavEnv` with its seed and its actions goes: they run the same code. Spaces,
    seeds, autoreset modes and infos are those of Gymnasium's `SyncVectorEnv`. What is returned shares no memory with
    what was returned before.

    Args:
        num_envs: how many worlds
        autoreset_mode: when an episode that has ended begins anew: "NextStep" (in the next step, which ignores that
            world's action), "SameStep" (at once; what ended is in the infos `final_obs` and `final_info`) or "Disabled"
            (when `reset(options={"reset_mask": ...})` says so)
        action_repeat: control periods that an action lasts, at most to the end of the episode. With more than one,
            rewards are float32 sums over them, as PPO's buffers keep rewards, and infos are those of `merged_infos`
        arguments: those of `SocNavEnv`; all worlds share one reward and one observation object
    """

    def __init__(
        self,
        num_envs: int = 1,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        action_repeat: int = 1,
        **arguments: Any,
    ) -> None:
        for name, number in (("num_envs", num_envs), ("action_repeat", action_repeat)):
            if number < 1:
                raise ValueError(f"{name} must be at least 1, got {number}")
        self.num_envs, self.action_repeat = num_envs, action_repeat
        self.autoreset_mode = autoreset_mode_of(autoreset_mode)
        first = SocNavEnv(**arguments)
        shared = {
            **arguments,
            "reward": first.reward,
            "observation": first.observation,
            "config": first.config,
            "scenario": first.scenario,
        }
        self.envs = [first, *(SocNavEnv(**shared) for _ in range(num_envs - 1))]
        self.metadata = {**first.metadata, "autoreset_mode": self.autoreset_mode}
        self.render_mode = first.render_mode
        self.single_action_space, self.single_observation_space = first.action_space, first.observation_space
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._seen = _make_batch(first, num_envs)
        self._rewards = np.zeros(num_envs)
        self._terminations = np.zeros(num_envs, dtype=np.bool_)
        self._truncations = np.zeros(num_envs, dtype=np.bool_)

    def reset(
        self,
        *,
        seed: Seeds = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Draw new scenes; see Gymnasium.

        Args:
            seed: one for each world in a list; or an int s, which gives world i the seed s + i
            options: `reset_mask`, a bool array (num_envs,), leaves the worlds that it does not name as they are
        """
        seeds = seeds_of(seed, self.num_envs)
        others = dict(options or {})
        chosen = named_by(others.pop("reset_mask", None), [env.has_scene for env in self.envs])
        check_options(others)
        infos = self.reset_some(chosen, [seeds[index] for index in chosen])
        return self.observations(), batch_infos(dict(zip(chosen, infos, strict=True)), self.num_envs)

    def step(self, actions: ArrayLike) -> tuple[Any, FloatArray, BoolArray, BoolArray, dict[str, Any]]:
        """Let one action pass in every world, by default one control period; see Gymnasium.

        Args:
            actions: (num_envs, size of an action)

        Raises:
            ValueError: For actions that are not finite numbers of this shape.
            ResetNeeded: After the end of an episode that nothing resets; no world has moved then.
        """
        restarting = self._ended() if self.autoreset_mode is AutoresetMode.NEXT_STEP else []
        running = [index for index in range(self.num_envs) if index not in restarting]
        infos = self._act(running, actions)
        infos.update(zip(restarting, self.reset_some(restarting), strict=True))
        returned = self._rewards.copy(), self._terminations.copy(), self._truncations.copy()
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            self._restart(self._ended(), infos)
        return self.observations(), *returned, batch_infos(infos, self.num_envs)

    def step_some(self, chosen: Sequence[int], actions: ArrayLike) -> list[StepResult]:
        """Let one control period pass in some of the worlds and reset none: for loops of one's own.

        Args:
            chosen: indices of worlds whose episodes go on
            actions: (num_envs, size of an action), of which those of the chosen are read

        Returns:
            A result for each of them, in their order; what they see is in `observations`. Raises as `step`.
        """
        envs = [self.envs[index] for index in chosen]
        commands = commands_of(actions, chosen, self.action_space.shape, self.envs[0].config)
        for env in envs:
            env.require_running()
        for env, command in zip(envs, commands, strict=True):
            env.advance(command)
        scores = judge_all([env.reward.scorer for env in envs], [env.window() for env in envs])
        return [self._conclude(index, each) for index, each in zip(chosen, scores, strict=True)]

    def reset_some(self, chosen: Sequence[int], seeds: Sequence[int | None] | None = None) -> list[dict[str, Any]]:
        """Draw new scenes for some of the worlds and return the info of each, in their order."""
        infos = []
        for index, seed in zip(chosen, [None] * len(chosen) if seeds is None else seeds, strict=True):
            infos.append(self.envs[index].begin(seed))
            self._seen.write(index, self.envs[index])
            self._rewards[index], self._terminations[index], self._truncations[index] = 0.0, False, False
        return infos

    def observations(self) -> Any:
        """What all worlds see now, of `observation_space`."""
        return self._seen.everything()

    def observation(self, index: int) -> Any:
        """What one world sees now, of `single_observation_space`."""
        return self._seen.one(index)

    def render(self) -> tuple[Any, ...]:
        """Return a picture of each world, or show them, as `render_mode` says."""
        return tuple(env.render() for env in self.envs)

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Call a method of every world's environment; of an attribute that is none, return the value."""
        found = [getattr(env, name) for env in self.envs]
        return tuple(each(*args, **kwargs) if callable(each) else each for each in found)

    def call_some(self, chosen: Sequence[int], name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Call a method of some of the worlds' environments."""
        return tuple(getattr(self.envs[index], name)(*args, **kwargs) for index in chosen)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Return an attribute of every world's environment."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute of every world's environment, to one value or to one each from a list or tuple."""
        for env, value in zip(self.envs, values_for(values, self.num_envs), strict=True):
            setattr(env, name, value)

    def close_extras(self, **kwargs: Any) -> None:
        """Close the windows, if there are any."""
        for env in self.envs:
            env.close()

    @property  # type: ignore[misc]  # read-only and a tuple, as SyncVectorEnv's
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """Every world's random generator."""
        return self.get_attr("np_random")

    @property
    def np_random_seed(self) -> tuple[int | None, ...]:  # type: ignore[override]  # likewise
        """What every world was seeded with last."""
        return self.get_attr("np_random_seed")

    def _act(self, running: Sequence[int], actions: ArrayLike) -> dict[int, dict[str, Any]]:
        """Let an action last its control periods, and return the info of each world by its index."""
        if self.action_repeat == 1:
            results = self.step_some(running, actions)
            return {index: result.info for index, result in zip(running, results, strict=True)}
        infos: dict[int, list[dict[str, Any]]] = {index: [] for index in running}
        totals = np.zeros(self.num_envs, dtype=np.float32)
        for _ in range(self.action_repeat):
            for index, result in zip(running, self.step_some(running, actions), strict=True):
                totals[index] += result.reward
                infos[index].append(result.info)
            running = [each for each in running if not (self._terminations[each] or self._truncations[each])]
            if not running:
                break
        self._rewards[:] = totals
        return {index: merged_infos(each) for index, each in infos.items()}

    def _conclude(self, index: int, scores: Scores | None) -> StepResult:
        """End a world's step and have the robot look."""
        result = self.envs[index].conclude(scores)
        self._rewards[index], self._terminations[index], self._truncations[index], _ = result
        self._seen.write(index, self.envs[index])
        return result

    def _ended(self) -> list[int]:
        ended: list[int] = np.flatnonzero(self._terminations | self._truncations).tolist()
        return ended

    def _restart(self, ended: list[int], infos: dict[int, dict[str, Any]]) -> None:
        """Reset worlds, and keep in their infos what had been seen and said."""
        final = {index: {"final_obs": self.observation(index), "final_info": infos[index]} for index in ended}
        for index, info in zip(ended, self.reset_some(ended), strict=True):
            infos[index] = {**info, **final[index]}


class _Batch(Protocol):
    """What all worlds see, kept until they see something else."""

    def write(self, index: int, env: SocNavEnv) -> None:
        """Have a world look."""

    def one(self, index: int) -> Any:
        """What one world sees, in memory of its own."""

    def everything(self) -> Any:
        """What all worlds see, in memory of its own."""


class _RowBatch:
    """Observations that are written in place, a row each."""

    def __init__(self, observation: RowObservation, num_envs: int) -> None:
        self._observation = observation
        self._rows = np.zeros((num_envs, observation.size), dtype=np.float32)

    def write(self, index: int, env: SocNavEnv) -> None:
        self._observation.write(env.world, env.time_left, self._rows[index])

    def one(self, index: int) -> Any:
        return self._observation.unpack(self._rows[index])

    def everything(self) -> Any:
        return self._observation.unpack(self._rows)


class _ItemBatch:
    """Any other observations, put together by Gymnasium."""

    def __init__(self, env: SocNavEnv, num_envs: int) -> None:
        self._space: spaces.Space[Any] = env.observation_space
        self._items: list[Any] = [None] * num_envs

    def write(self, index: int, env: SocNavEnv) -> None:
        self._items[index] = env.observe()

    def one(self, index: int) -> Any:
        return deepcopy(self._items[index])

    def everything(self) -> Any:
        batch = create_empty_array(self._space, len(self._items), fn=np.empty)
        return concatenate(self._space, self._items, batch)  # type: ignore[arg-type]  # its own counterpart's result


def _make_batch(env: SocNavEnv, num_envs: int) -> _Batch:
    if isinstance(env.observation, RowObservation):
        return _RowBatch(env.observation, num_envs)
    return _ItemBatch(env, num_envs)
