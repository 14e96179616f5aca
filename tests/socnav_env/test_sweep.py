"""Gymnasium's and Stable-Baselines3's checkers on every kind of environment; `pytest -m slow` checks all of them."""

import itertools
import warnings

import gymnasium as gym
import pytest
from gymnasium.utils.env_checker import check_env as gymnasium_check
from stable_baselines3.common.env_checker import check_env as stable_baselines_check

from socnav_env.config import EnvConfig, RobotConfig
from socnav_env.config.robot import DRIVES
from socnav_env.observations import OBSERVATIONS
from socnav_env.rewards import REWARDS
from socnav_env.wrappers import DiscreteActions
from tests.socnav_env.strategies import SCENARIOS

ACTIONS = (*DRIVES, *(f"discrete {drive}" for drive in DRIVES))
EVERYTHING = [
    *itertools.product(OBSERVATIONS, REWARDS, ACTIONS, [None]),
    *itertools.product(OBSERVATIONS, ["learned"], DRIVES, SCENARIOS),
]
# Each kind of observation and action once with a reward that reads frames, each reward once, each scenario once.
SELECTION = [
    *(
        (observation, "learned", actions, None)
        for observation, actions, _ in zip(
            itertools.cycle(OBSERVATIONS),
            itertools.cycle(ACTIONS),
            range(max(len(OBSERVATIONS), len(ACTIONS))),
            strict=False,
        )
    ),
    *(("flat", reward, "holonomic", None) for reward in REWARDS),
    *(("entities", "crowdnav", "differential", scenario) for scenario in SCENARIOS),
]


def make(observation: str, reward: str, actions: str, scenario: str | None) -> gym.Env:
    discrete, _, drive = actions.rpartition(" ")
    config = EnvConfig(robot=RobotConfig(drive=drive), time_limit=10.0)
    env = gym.make("SocNav2-v0", reward=reward, observation=observation, config=config, scenario=scenario).unwrapped
    return DiscreteActions(env) if discrete else env


def check(env: gym.Env) -> None:
    """Warnings are errors in these tests, but for the one that a wrapper is no bare environment."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*different from the unwrapped version")
        gymnasium_check(env, skip_render_check=True)
    stable_baselines_check(env)


def test_gymnasium_finds_nothing_to_say_about_pictures() -> None:
    gymnasium_check(gym.make("SocNav2-v0", reward="sparse").unwrapped)


@pytest.mark.usefixtures("without_weights")
@pytest.mark.parametrize(("observation", "reward", "actions", "scenario"), SELECTION)
def test_checkers_find_nothing_to_say(observation: str, reward: str, actions: str, scenario: str | None) -> None:
    check(make(observation, reward, actions, scenario))


@pytest.mark.slow
@pytest.mark.usefixtures("without_weights")
@pytest.mark.parametrize(("observation", "reward", "actions", "scenario"), EVERYTHING)
def test_checkers_find_nothing_to_say_about_anything(
    observation: str, reward: str, actions: str, scenario: str | None
) -> None:
    check(make(observation, reward, actions, scenario))
