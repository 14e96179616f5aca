"""Training environments: what they are made of, here and in other processes."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

from agents.envs import SocNavMaker, make_training_envs

SHORT = SocNavMaker(reward="crowdnav", config={"time_limit": 2.0})  # 10 control steps


def test_the_real_environment_fits_in() -> None:
    maker = SocNavMaker(reward="sparse", config={"time_limit": 1.0})
    envs = make_training_envs(maker, num_envs=2, num_workers=0, action_repeat=5)
    try:
        envs.reset()
        _, rewards, dones, infos = envs.step(np.zeros((2, 2), np.float32))
        assert rewards.tolist() == [0.0, 0.0]
        assert dones.tolist() == [True, True]
        assert [info["episode"]["l"] for info in infos] == [5, 5]
        assert isinstance(maker(), gym.Env)
    finally:
        envs.close()


def test_episodes_begin_in_the_scenario_asked_for() -> None:
    maker = SocNavMaker(reward="sparse", scenario="couple_towards")
    assert maker().unwrapped.scenario.name == "couple_towards"
    envs = make_training_envs(maker, num_envs=2, num_workers=0)
    try:
        observation = envs.reset()
        assert observation["people_mask"].sum(axis=1).tolist() == [2.0, 2.0]
    finally:
        envs.close()


@pytest.mark.parametrize(("num_envs", "num_workers", "action_repeat"), [(5, 2, 4), (1, 2, 1)])
def test_other_processes_change_nothing(num_envs: int, num_workers: int, action_repeat: int) -> None:
    here, there = (make_training_envs(SHORT, num_envs, workers, action_repeat) for workers in (0, num_workers))
    try:
        for envs in (here, there):
            envs.seed(7)
        _assert_equal(here.reset(), there.reset())
        generator = np.random.default_rng(0)
        for _ in range(12):  # past the end of the first episodes
            actions = generator.uniform(-1, 1, (num_envs, 2)).astype(np.float32)
            ours, theirs = here.step(actions), there.step(actions)
            _assert_equal(ours[0], theirs[0])
            np.testing.assert_array_equal(ours[1], theirs[1])
            np.testing.assert_array_equal(ours[2], theirs[2])
            for own, other in zip(ours[3], theirs[3], strict=True):
                assert own.keys() == other.keys()
                assert own["TimeLimit.truncated"] == other["TimeLimit.truncated"]
                assert own["reward_terms"] == other["reward_terms"]
        there.set_attr("render_mode", "human", indices=num_envs - 1)
        assert there.get_attr("render_mode") == [None] * (num_envs - 1) + ["human"]
        assert there.get_attr("render_mode", indices=[num_envs - 1]) == ["human"]
        assert there.env_method("window", indices=[num_envs - 1]) == [[]]
    finally:
        here.close()
        there.close()
        there.close()


def test_an_error_in_a_worker_is_raised_here() -> None:
    envs = make_training_envs(SHORT, 2, 2)
    try:
        envs.reset()
        with pytest.raises(ValueError, match="action must be two finite numbers"):
            envs.step(np.full((2, 2), np.nan, np.float32))
        with pytest.raises(AttributeError, match="no_such_method"):
            envs.env_method("no_such_method", indices=[1])
    finally:
        envs.close()


def _assert_equal(ours: dict[str, np.ndarray], theirs: dict[str, np.ndarray]) -> None:
    assert ours.keys() == theirs.keys()
    for key, values in ours.items():
        np.testing.assert_array_equal(values, theirs[key])
