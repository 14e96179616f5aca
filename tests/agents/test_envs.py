"""What training environments add to the environment itself."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

from agents.envs import RepeatedAction, SocNavMaker, TrainingMaker, make_training_envs
from tests.agents.disc import DiscEnv


class CountingEnv(DiscEnv):
    """Pays 1, 2, 3, ... and scores a tenth of that."""

    def step(self, action: np.ndarray) -> tuple:
        observation, _, terminated, truncated, info = super().step(action)
        return observation, float(self.count), terminated, truncated, {**info, "q2": self.count / 10}


def test_a_repeated_action_adds_up_rewards_and_averages_scores() -> None:
    env = RepeatedAction(CountingEnv(), 3)
    env.reset(seed=0)
    first, second = (env.step(np.zeros(2, np.float32)) for _ in range(2))
    assert (first[1], second[1]) == (1 + 2 + 3, 4 + 5 + 6)
    assert (first[4]["q2"], second[4]["q2"]) == pytest.approx((0.2, 0.5))


def test_a_repeated_action_ends_with_the_episode() -> None:
    env = RepeatedAction(CountingEnv(steps=4), 3)
    env.reset(seed=0)
    assert env.step(np.zeros(2, np.float32))[2:4] == (False, False)
    _, reward, terminated, truncated, _ = env.step(np.zeros(2, np.float32))
    assert (reward, terminated, truncated) == (4.0, False, True)


def test_training_reports_returns_and_lengths_in_control_steps() -> None:
    env = TrainingMaker(CountingEnv, 7)()
    env.reset(seed=0)
    ended = False
    while not ended:
        _, _, terminated, truncated, info = env.step(np.zeros(2, np.float32))
        ended = terminated or truncated
    assert (info["episode"]["l"], info["episode"]["r"]) == (60, 60 * 61 / 2)
    assert info["episode"]["is_success"] is False


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
