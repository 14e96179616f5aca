"""`SocNavWorkerVectorEnv`: many worlds, spread over a few processes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from itertools import chain, pairwise
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from reward_model.base.arrays import BoolArray, FloatArray
from socnav_env.config import EnvConfig
from socnav_env.env import check_options
from socnav_env.vector.arguments import Seeds, commands_of, named_by, seeds_of, values_for
from socnav_env.vector.env import SocNavVectorEnv
from socnav_env.vector.infos import join_infos
from socnav_env.vector.worker_pool import WorkerPool


class SocNavWorkerVectorEnv(VectorEnv[Any, NDArray[np.float32], NDArray[Any]]):
    """A `SocNavVectorEnv` in each of a few processes, seen as one: what to use where there are cores to spare.

    Every world goes the way that it goes in a `SocNavVectorEnv`, and everything returned is the same. A step costs a
    message to each process and one back, so processes pay from a few worlds each on. Rewards and observations that
    are objects of one's own are pickled, as are attributes asked for; scripts need `if __name__ == "__main__":`.

    Args:
        num_envs: how many worlds
        num_workers: how many processes share them, as evenly as can be
        autoreset_mode, arguments: see `SocNavVectorEnv`
    """

    def __init__(
        self,
        num_envs: int,
        num_workers: int,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        **arguments: Any,
    ) -> None:
        if not 1 <= num_workers <= num_envs:
            raise ValueError(f"num_workers must be from 1 to num_envs, {num_envs}, got {num_workers}")
        ends = [num_envs * worker // num_workers for worker in range(num_workers + 1)]
        self._shares = [slice(*pair) for pair in pairwise(ends)]
        self._sizes = [share.stop - share.start for share in self._shares]
        self._pool = WorkerPool([partial(_Part, size, autoreset_mode, arguments) for size in self._sizes])
        try:
            self._description: _Description = self._pool.ask_all("description")[0]
        except BaseException:
            self._pool.close()
            raise
        self.num_envs = num_envs
        self.metadata, self.render_mode = self._description.metadata, self._description.render_mode
        self.autoreset_mode = self.metadata["autoreset_mode"]
        self.single_action_space = self._description.action_space
        self.single_observation_space = self._description.observation_space
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._has_scene = np.zeros(num_envs, dtype=np.bool_)
        self._ended = np.zeros(num_envs, dtype=np.bool_)

    def reset(self, *, seed: Seeds = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Draw new scenes; see `SocNavVectorEnv.reset`."""
        seeds = seeds_of(seed, self.num_envs)
        others = dict(options or {})
        chosen = named_by(others.pop("reset_mask", None), self._has_scene)
        check_options(others)
        named = np.zeros(self.num_envs, dtype=np.bool_)
        named[chosen] = True
        answers = self._pool.ask_all("reset", [(seeds[share], named[share]) for share in self._shares])
        self._has_scene[chosen], self._ended[chosen] = True, False
        observations, infos = zip(*answers, strict=True)
        return self._observations(observations), join_infos(infos, self._sizes)

    def step(self, actions: ArrayLike) -> tuple[Any, FloatArray, BoolArray, BoolArray, dict[str, Any]]:
        """Let one action pass in every world; see `SocNavVectorEnv.step`."""
        values = self._checked(actions)
        answers = self._pool.ask_all("step", [(values[share],) for share in self._shares])
        observations, rewards, terminations, truncations, infos = zip(*answers, strict=True)
        returned = np.concatenate(rewards), np.concatenate(terminations), np.concatenate(truncations)
        if self.autoreset_mode is not AutoresetMode.SAME_STEP:
            self._ended = returned[1] | returned[2]
        return self._observations(observations), *returned, join_infos(infos, self._sizes)

    def render(self) -> tuple[Any, ...]:
        """Return a picture of each world, or show them, as `render_mode` says."""
        return self.call("render")

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Call a method of every world's environment; of an attribute that is none, return the value."""
        return tuple(chain.from_iterable(self._pool.ask_all("call", [(name, args, kwargs)] * len(self._pool))))

    def call_some(self, chosen: Sequence[int], name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Call a method of some of the worlds' environments."""
        workers = [next(place for place, share in enumerate(self._shares) if index < share.stop) for index in chosen]
        return tuple(
            self._pool.ask(worker, "call_some", [index - self._shares[worker].start], name, args, kwargs)[0]
            for worker, index in zip(workers, chosen, strict=True)
        )

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Return an attribute of every world's environment."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute of every world's environment, to one value or to one each from a list or tuple."""
        each = values_for(values, self.num_envs)
        self._pool.ask_all("set_attr", [(name, each[share]) for share in self._shares])

    def close_extras(self, **kwargs: Any) -> None:
        """End the processes."""
        self._pool.close()

    @property  # type: ignore[misc]  # read-only and a tuple, as SyncVectorEnv's
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """A copy of every world's random generator."""
        return self.get_attr("np_random")

    @property
    def np_random_seed(self) -> tuple[int | None, ...]:  # type: ignore[override]  # likewise
        """What every world was seeded with last."""
        return self.get_attr("np_random_seed")

    def _checked(self, actions: ArrayLike) -> FloatArray:
        """Actions that no worker refuses, so that either all worlds move or none."""
        if not self._has_scene.all():
            raise gym.error.ResetNeeded("there is no scene yet, call reset() first")
        if self.autoreset_mode is AutoresetMode.DISABLED and self._ended.any():
            raise gym.error.ResetNeeded(f"the episode of world {self._ended.argmax()} has ended, call reset()")
        values = np.asarray(actions, dtype=np.float64)
        running = np.flatnonzero(~self._ended)
        if values.shape != self.action_space.shape or not np.isfinite(values[running]).all():
            commands_of(values, running.tolist(), self.action_space.shape, self._description.config)
        return values

    def _observations(self, parts: Sequence[Any]) -> Any:
        return _joined(self.single_observation_space, parts)


class _Description(NamedTuple):
    """What is the same in every process."""

    config: EnvConfig
    metadata: dict[str, Any]
    render_mode: str | None
    action_space: spaces.Space[Any]
    observation_space: spaces.Space[Any]


class _Part:
    """The worlds of one process."""

    def __init__(self, num_envs: int, autoreset_mode: AutoresetMode | str, arguments: dict[str, Any]) -> None:
        self._envs = SocNavVectorEnv(num_envs, autoreset_mode, **arguments)

    def description(self) -> _Description:
        envs = self._envs
        first = envs.envs[0]
        return _Description(
            first.config, envs.metadata, envs.render_mode, first.action_space, envs.single_observation_space
        )

    def reset(self, seeds: Sequence[int | None], named: BoolArray) -> tuple[Any, dict[str, Any]]:
        if not named.any():  # Gymnasium's masks name somebody
            return self._envs.observations(), {}
        return self._envs.reset(seed=list(seeds), options={"reset_mask": named})

    def step(self, actions: FloatArray) -> tuple[Any, FloatArray, BoolArray, BoolArray, dict[str, Any]]:
        return self._envs.step(actions)

    def call(self, name: str, args: tuple[Any, ...], kwargs: dict[str, Any]) -> tuple[Any, ...]:
        return self._envs.call(name, *args, **kwargs)

    def call_some(self, chosen: Sequence[int], name: str, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
        return self._envs.call_some(chosen, name, *args, **kwargs)

    def set_attr(self, name: str, values: Sequence[Any]) -> None:
        self._envs.set_attr(name, list(values))

    def close(self) -> None:
        self._envs.close()


def _joined(space: spaces.Space[Any], parts: Sequence[Any]) -> Any:
    """Batches of what lies in a space, put into one as `batch_space` has it."""
    if isinstance(space, spaces.Dict):
        return {key: _joined(each, [part[key] for part in parts]) for key, each in space.items()}
    if isinstance(space, spaces.Tuple):
        return tuple(_joined(each, column) for each, column in zip(space, zip(*parts, strict=True), strict=True))
    if isinstance(parts[0], np.ndarray):
        return np.concatenate(parts)
    return tuple(chain.from_iterable(parts))  # of spaces that Gymnasium does not batch
