"""Agents by name and by file."""

from __future__ import annotations

from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import spaces
from safetensors.numpy import save_file

import socnav_env  # noqa: F401 - registers SocNav2-v0
from agents import AgentError, agent_names, load_agent
from agents.baselines import StraightPolicy
from agents.policy import Policy
from agents.policy_files import build_policy, save_policy
from tests.agents.disc import entities_space

ARCHITECTURE = {"entity_width": 8, "net_arch": [8], "log_std_init": -0.5}
ACTIONS = spaces.Box(-1.0, 1.0, (2,), np.float32)


def test_baselines_by_name() -> None:
    assert isinstance(load_agent("straight"), StraightPolicy)
    assert agent_names()[:2] == ["random", "straight"]


def test_a_saved_policy_acts_the_same(tmp_path: Path) -> None:
    policy = build_policy(entities_space(), ACTIONS, ARCHITECTURE)
    save_policy(policy, ARCHITECTURE, tmp_path / "agent.safetensors")
    observation = entities_space().sample()
    for path in (tmp_path, tmp_path / "agent.safetensors"):
        loaded = load_agent(path)
        assert isinstance(loaded, Policy)
        np.testing.assert_array_equal(
            loaded.predict(observation, deterministic=True)[0], policy.predict(observation, deterministic=True)[0]
        )
    assert [path.name for path in tmp_path.iterdir()] == ["agent.safetensors"]


def test_an_unknown_name_lists_the_valid_ones() -> None:
    with pytest.raises(AgentError, match="no agent 'stright'; valid are random, straight"):
        load_agent("stright")


def test_other_files_are_refused(tmp_path: Path) -> None:
    text = tmp_path / "notes.txt"
    text.write_text("no tensors")
    with pytest.raises(AgentError, match=r"notes\.txt: is no file of tensors"):
        load_agent(text)
    tensors = tmp_path / "other.safetensors"
    save_file({"weight": np.zeros(2, np.float32)}, tensors)
    with pytest.raises(AgentError, match="its header must describe a socnav2-agent-2, got nothing"):
        load_agent(tensors)


def test_the_agent_that_ships_acts_in_the_environment() -> None:
    env = gym.make("SocNav2-v0", reward="sparse")
    observation, _ = env.reset(seed=0)
    agent = load_agent("ppo-learned")
    action, _ = agent.predict(observation, deterministic=True)
    assert env.action_space.contains(action)
    again, _ = agent.predict(observation, deterministic=True)
    assert np.array_equal(action, again)
    assert "ppo-learned" in agent_names()
