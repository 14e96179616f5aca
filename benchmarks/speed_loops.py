"""Steps a second of environments under random actions, and timers of functions."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from gymnasium.vector import AutoresetMode

import socnav_env  # noqa: F401 - registers SocNav2-v0

SCENE_STEPS = 32  # of a single environment before the scene of the next seed


Seconds = defaultdict[str, float]


def play_single(environment: gym.Env[Any, Any], steps: int, after_call: Callable[[], object] = lambda: None) -> float:
    """Step with random actions through many scenes, since some have many people, and return steps a second.

    Args:
        after_call: called after every reset and every step; neither it nor resets are timed
    """
    seconds, seed, ended = 0.0, 0, True
    for step, action in enumerate(np.random.default_rng(0).uniform(-1, 1, (steps, 2)).astype(np.float32)):
        if ended or step % SCENE_STEPS == 0:
            environment.reset(seed=seed)
            after_call()
            seed += 1
        begin = time.perf_counter()
        _, _, terminated, truncated, _ = environment.step(action)
        seconds += time.perf_counter() - begin
        after_call()
        ended = terminated or truncated
    return steps / seconds


def play_vector(environments: Any, steps: int) -> float:
    """Step with random actions and return steps a second, of all worlds together; resets are not timed."""
    num_envs = environments.num_envs
    seconds, rounds = 0.0, -(-steps // num_envs)
    environments.reset(seed=0)
    for actions in np.random.default_rng(0).uniform(-1, 1, (rounds, num_envs, 2)).astype(np.float32):
        begin = time.perf_counter()
        _, _, terminations, truncations, _ = environments.step(actions)
        seconds += time.perf_counter() - begin
        ended = terminations | truncations
        if ended.any():
            environments.reset(options={"reset_mask": ended})
    return rounds * num_envs / seconds


def make_single(**arguments: Any) -> gym.Env[Any, Any]:
    """Make `SocNav2-v0` as users do, but without Gymnasium's checker."""
    return gym.make("SocNav2-v0", disable_env_checker=True, **arguments)


def make_vector(num_envs: int, **arguments: Any) -> Any:
    """Make a vector environment of `SocNav2-v0` without automatic resets."""
    return gym.make_vec("SocNav2-v0", num_envs, autoreset_mode=AutoresetMode.DISABLED, **arguments)


def timed(owner: Any, name: str, part: str, spent: Seconds) -> AbstractContextManager[None]:
    """Add the seconds of a function's calls to `spent[part]` within the context."""
    function = getattr(owner, name)

    def called(*args: Any, **kwargs: Any) -> Any:
        begin = time.perf_counter()
        try:
            return function(*args, **kwargs)
        finally:
            spent[part] += time.perf_counter() - begin

    return _replaced(owner, name, called)


@contextmanager
def _replaced(owner: Any, name: str, called: Callable[..., Any]) -> Iterator[None]:
    function, is_own = getattr(owner, name), name in vars(owner)
    setattr(owner, name, called)
    try:
        yield
    finally:
        if is_own:
            setattr(owner, name, function)
        else:
            delattr(owner, name)


@contextmanager
def threads_of_torch(count: int) -> Iterator[None]:
    """Set the number of threads of PyTorch, and so of the fused network, within the context."""
    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)
