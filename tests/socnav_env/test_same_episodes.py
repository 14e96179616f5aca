"""Vectors of worlds and single environments play the same episodes, whatever the reward: `pytest -m slow` for many."""

import gymnasium as gym
import numpy as np
import pytest
import torch

import socnav_env  # noqa: F401 - registers SocNav2-v0
from socnav_env.rewards import REWARDS

NUM_WORLDS = 8
TOLERANCE = 1e-5
STATES = ("robot_poses", "robot_velocities", "people_poses", "people_velocities", "people_targets", "scores")


def actions_of(seed: int, steps: int) -> np.ndarray:
    """Mostly forward, so that episodes end in all ways."""
    random = np.random.default_rng(seed)
    return np.column_stack([random.uniform(0.0, 1.0, steps), random.normal(0.0, 0.5, steps)]).astype(np.float32)


def play_single(reward: str, seeds: range) -> dict[int, tuple]:
    """The rewards and the trajectory of each episode."""
    env = gym.make("SocNav2-v0", reward=reward, disable_env_checker=True).unwrapped
    episodes = {}
    for seed in seeds:
        env.reset(seed=seed)
        rewards = []
        for action in actions_of(seed, env.config.max_steps):
            _, value, terminated, truncated, _ = env.step(action)
            rewards.append(value)
            if terminated or truncated:
                break
        episodes[seed] = rewards, env.trajectory
    return episodes


def play_vector(reward: str, seeds: range) -> dict[int, tuple]:
    """The same from worlds that go on to the next seed when an episode is over."""
    envs = gym.make_vec("SocNav2-v0", NUM_WORLDS, reward=reward, autoreset_mode="Disabled")
    waiting, episodes = list(seeds)[::-1], {}
    running = [waiting.pop() for _ in range(NUM_WORLDS)]
    envs.reset(seed=running)
    rewards, actions = [[] for _ in running], [actions_of(seed, envs.envs[0].config.max_steps) for seed in running]
    while len(episodes) < len(seeds):
        now = np.array([plan[len(done)] for plan, done in zip(actions, rewards, strict=True)])
        _, values, terminations, truncations, _ = envs.step(now)
        for world, value in enumerate(values.tolist()):
            rewards[world].append(value)
        ended = terminations | truncations
        for world in np.flatnonzero(ended):
            episodes.setdefault(running[world], (rewards[world], envs.envs[world].trajectory))
            running[world] = waiting.pop() if waiting else running[world]
            rewards[world], actions[world] = [], actions_of(running[world], len(actions[world]))
        if ended.any():
            envs.reset(seed=running, options={"reset_mask": ended})
    return episodes


def assert_same_episodes(reward: str, seeds: range) -> set:
    """Compare everything, and return the outcomes there were."""
    single, vector = play_single(reward, seeds), play_vector(reward, seeds)
    for seed in seeds:
        (rewards, episode), (others, other) = single[seed], vector[seed]
        np.testing.assert_allclose(rewards, others, rtol=0, atol=TOLERANCE, err_msg=f"seed {seed}")
        assert episode.outcome is other.outcome, seed
        for name in STATES:
            one, two = getattr(episode, name), getattr(other, name)
            np.testing.assert_allclose(one, two, rtol=0, atol=TOLERANCE, err_msg=f"seed {seed}: {name}")
    return {episode.outcome for _, episode in single.values()}


@pytest.mark.parametrize(("reward", "num_threads"), [("learned", 1), ("learned", 2), ("crowdnav", 1)])
def test_a_few_episodes_are_the_same(reward: str, num_threads: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch, "get_num_threads", lambda: num_threads)
    assert_same_episodes(reward, range(12))


@pytest.mark.slow
@pytest.mark.parametrize("reward", REWARDS)
def test_many_episodes_are_the_same(reward: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch, "get_num_threads", lambda: 2)
    assert len(assert_same_episodes(reward, range(200))) >= 3
