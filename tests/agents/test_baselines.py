"""The baselines act as their names say, on single observations and on batches."""

from __future__ import annotations

import numpy as np
import pytest

from agents.baselines import BASELINES, RandomPolicy, StraightPolicy
from agents.policy import Policy, act
from socnav_env.config import EnvConfig, RobotConfig
from socnav_env.env import SocNavEnv
from tests.agents.disc import entities_space


def observation(goal: tuple[float, float]) -> dict[str, np.ndarray]:
    return {
        key: np.array(goal, np.float32) if key == "goal" else np.zeros(box.shape, np.float32)
        for key, box in entities_space().items()
    }


@pytest.mark.parametrize(
    ("goal", "action"),
    [
        ((3.0, 0.0), [1.0, 0.0]),
        ((0.0, 3.0), [0.0, 1.0]),
        ((-1.0, -1.0), [0.0, -1.0]),
        ((1.0, 0.1), [1.0, 4 * np.arctan(0.1)]),
    ],
)
def test_straight_turns_first_and_then_drives(goal: tuple[float, float], action: list[float]) -> None:
    np.testing.assert_allclose(StraightPolicy().predict(observation(goal))[0], action, rtol=1e-6)


@pytest.mark.parametrize("name", BASELINES)
def test_a_batch_equals_its_singles(name: str) -> None:
    policy = BASELINES[name]()
    assert isinstance(policy, Policy)
    singles = [observation((1.0, 2.0)), observation((-3.0, 0.5))]
    batch = {key: np.stack([single[key] for single in singles]) for key in singles[0]}
    actions, state = policy.predict(batch)
    assert state is None
    np.testing.assert_array_equal(actions, [policy.predict(single)[0] for single in singles])


def test_random_differs_by_observation_and_seed_and_repeats() -> None:
    first, second = observation((1.0, 2.0)), observation((1.0, 2.1))
    action = RandomPolicy(seed=1).predict(first)[0]
    assert action.shape == (2,)
    np.testing.assert_array_equal(action, RandomPolicy(seed=1).predict(first)[0])
    assert not np.array_equal(action, RandomPolicy(seed=1).predict(second)[0])
    assert not np.array_equal(action, RandomPolicy(seed=2).predict(first)[0])


@pytest.mark.parametrize("name", BASELINES)
def test_baselines_drive_a_holonomic_robot_straight_on(name: str) -> None:
    env = SocNavEnv(reward="sparse", config=EnvConfig(robot=RobotConfig(drive="holonomic")))
    seen, _ = env.reset(seed=1)
    policy = BASELINES[name]()
    forward, left, turn = act(policy, env, seen)
    assert left == 0.0
    np.testing.assert_array_equal([forward, turn], policy.predict(seen)[0])
    env.step(act(policy, env, seen))


def test_random_fills_the_action_space() -> None:
    actions = np.array([RandomPolicy().predict(observation((x, 0.0)))[0] for x in np.linspace(-5, 5, 500)])
    assert (np.abs(actions) <= 1).all()
    np.testing.assert_allclose(actions.mean(axis=0), 0.0, atol=0.1)
    np.testing.assert_allclose(actions.std(axis=0), 1 / np.sqrt(3), atol=0.05)
