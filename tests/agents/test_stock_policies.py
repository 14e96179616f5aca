"""Stable-Baselines3's own policies learn from every kind of observation, in vectors of worlds and from one alone."""

import numpy as np
import pytest
import torch
from gymnasium import spaces
from stable_baselines3 import DQN, PPO
from stable_baselines3.common.vec_env import VecFrameStack

from agents.vector import SB3VecEnv
from socnav_env.config import EnvConfig, RobotConfig
from socnav_env.env import SocNavEnv
from socnav_env.observations import OBSERVATIONS
from socnav_env.vector.env import SocNavVectorEnv
from socnav_env.wrappers import DiscreteActions

SHORT = EnvConfig(time_limit=2.0, robot=RobotConfig(drive="holonomic"))  # episodes end within the few steps


@pytest.fixture(autouse=True)
def _one_thread() -> None:
    torch.set_num_threads(1)


@pytest.mark.parametrize("name", OBSERVATIONS)
def test_ppo_learns_in_a_vector_of_worlds(name: str) -> None:
    envs = SB3VecEnv(SocNavVectorEnv(2, "SameStep", reward="dsrnn", observation=name, config=SHORT))
    policy = "MultiInputPolicy" if isinstance(envs.observation_space, spaces.Dict) else "MlpPolicy"
    model = PPO(policy, envs, n_steps=32, batch_size=32, n_epochs=1, seed=0, device="cpu")
    before = [each.clone() for each in model.policy.parameters()]
    model.learn(64)
    after = list(model.policy.parameters())
    assert model.num_timesteps == 64
    assert any(not torch.equal(one, other) for one, other in zip(before, after, strict=True))
    assert all(torch.isfinite(each).all() for each in after)


@pytest.mark.parametrize("name", OBSERVATIONS)
def test_stable_baselines_stacks_past_observations(name: str) -> None:
    def first(observations):
        return observations["robot"] if isinstance(observations, dict) else observations

    envs = SB3VecEnv(SocNavVectorEnv(2, "SameStep", reward="dsrnn", observation=name, config=SHORT))
    stacked = VecFrameStack(envs, n_stack=3)
    size = first(envs.reset()).shape[1]
    before = first(stacked.reset())
    after = first(stacked.step(np.zeros((2, 3)))[0])
    assert before.shape == after.shape == (2, 3 * size)
    np.testing.assert_array_equal(after[:, size : 2 * size], before[:, 2 * size :])


@pytest.mark.parametrize("name", OBSERVATIONS)
def test_dqn_learns_from_numbered_actions(name: str) -> None:
    env = DiscreteActions(SocNavEnv(reward="dsrnn", observation=name, config=SHORT))
    policy = "MultiInputPolicy" if isinstance(env.observation_space, spaces.Dict) else "MlpPolicy"
    model = DQN(policy, env, learning_starts=8, buffer_size=64, batch_size=8, seed=0, device="cpu")
    model.learn(24)
    action, _ = model.predict(env.reset(seed=0)[0])
    assert env.action_space.contains(action)
