"""Whatever is configured and done, nothing breaks and everything stays within its bounds.

`pytest -m slow tests/socnav_env/test_random_play.py` plays 200,000 steps.
"""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, reject, settings
from hypothesis import strategies as st

from socnav_env.config import ConfigError, EnvConfig
from socnav_env.env import SocNavEnv
from socnav_env.observations import OBSERVATIONS
from socnav_env.rewards import LearnedReward, MixedReward, make_reward
from tests.socnav_env.conftest import FeatureScorer
from tests.socnav_env.strategies import SCENARIOS, env_configs

STEPS, MANY_STEPS, TOTAL = 40, 500, 200_000
HAND_MADE = ("crowdnav", "dsrnn", "sparse")
some_scenario = st.sampled_from([None, *SCENARIOS])


def play_randomly(config: EnvConfig, observation: str, scenario: str | None, seed: int, steps: int) -> None:
    learned = LearnedReward({"social": 1.0, "arrival": 9.0, "contact": -9.0}, FeatureScorer())
    hand_made = {name: (1.0, make_reward(name, config.reward)) for name in HAND_MADE}
    reward = MixedReward({"learned": (1.0, learned), **hand_made})
    env = make(reward=reward, observation=observation, config=config, scenario=scenario)
    random = np.random.default_rng(seed)
    seen = reset(env, seed)
    action = random.uniform(-1, 1, env.action_space.shape)
    for _ in range(steps):
        assert env.observation_space.contains(seen)
        if random.random() < 0.1:  # held for a while, so that the robot gets somewhere
            action = random.uniform(-1.5, 1.5, env.action_space.shape)
        seen, reward, terminated, truncated, info = env.step(action)
        assert np.isfinite(reward)
        assert reward == sum(info["reward_terms"].values())
        assert (info["outcome"] is not None) == (terminated or truncated) == ("episode_metrics" in info)
        if terminated or truncated:
            assert env.observation_space.contains(seen)
            seen = reset(env)


def make(**arguments) -> SocNavEnv:
    """Make one, or give up where the scenario has no room for such a robot or such people."""
    try:
        return SocNavEnv(**arguments)
    except ConfigError as error:
        assert "\n" not in str(error)
        reject()


def reset(env: SocNavEnv, seed: int | None = None) -> object:
    """Reset, or give up on a configuration of which no scene can be made; the message then says so in one line."""
    try:
        return env.reset(seed=seed)[0]
    except ConfigError as error:
        assert "\n" not in str(error)
        reject()


def random_play(steps: int, examples: int) -> int:
    """Play so many steps in each of so many configurations; returns how many steps were played to the end."""
    total = 0

    @settings(
        max_examples=examples, deadline=None, derandomize=True, database=None, suppress_health_check=[*HealthCheck]
    )
    @given(env_configs(), st.sampled_from(sorted(OBSERVATIONS)), some_scenario, st.integers(0, 2**32 - 1))
    def played(config: EnvConfig, observation: str, scenario: str | None, seed: int) -> None:
        nonlocal total
        play_randomly(config, observation, scenario, seed, steps)
        total += steps

    played()
    return total


def test_random_configurations_can_be_played() -> None:
    assert random_play(STEPS, examples=20) >= 20 * STEPS


@pytest.mark.slow
def test_200_000_random_steps() -> None:
    assert random_play(MANY_STEPS, examples=TOTAL // MANY_STEPS) >= TOTAL
