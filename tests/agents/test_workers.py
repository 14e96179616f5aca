"""Environments in worker processes behave as the same environments in this process."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

from agents.envs import make_training_envs
from tests.agents.disc import DiscEnv


class BrokenEnv(DiscEnv):
    def step(self, action: np.ndarray) -> tuple:
        raise ArithmeticError("the disc fell over")


@pytest.mark.parametrize(("num_envs", "num_workers"), [(5, 2), (1, 2)])
def test_workers_equal_a_single_process(num_envs: int, num_workers: int) -> None:
    here, there = (make_training_envs(DiscEnv, num_envs, workers) for workers in (0, num_workers))
    try:
        for envs in (here, there):
            envs.seed(7)
        _assert_equal(here.reset(), there.reset())
        generator = np.random.default_rng(0)
        for _ in range(70):  # past the end of the first episodes
            actions = generator.uniform(-1, 1, (num_envs, 2)).astype(np.float32)
            ours, theirs = here.step(actions), there.step(actions)
            _assert_equal(ours[0], theirs[0])
            np.testing.assert_array_equal(ours[1], theirs[1])
            np.testing.assert_array_equal(ours[2], theirs[2])
            for own, other in zip(ours[3], theirs[3], strict=True):
                assert own.keys() == other.keys()
                assert own["TimeLimit.truncated"] == other["TimeLimit.truncated"]
        assert there.get_attr("steps") == [60] * num_envs
        assert there.get_attr("steps", indices=[0]) == [60]
        there.set_attr("steps", 5, indices=num_envs - 1)
        assert there.get_attr("steps") == [60] * (num_envs - 1) + [5]
        assert there.env_is_wrapped(gym.Wrapper) == [True] * num_envs
    finally:
        here.close()
        there.close()
        there.close()


def test_an_error_in_a_worker_is_raised_here() -> None:
    envs = make_training_envs(BrokenEnv, 2, 2)
    try:
        envs.reset()
        with pytest.raises(ArithmeticError, match="the disc fell over"):
            envs.step(np.zeros((2, 2), np.float32))
    finally:
        envs.close()


def _assert_equal(ours: dict[str, np.ndarray], theirs: dict[str, np.ndarray]) -> None:
    assert ours.keys() == theirs.keys()
    for key, values in ours.items():
        np.testing.assert_array_equal(values, theirs[key])
