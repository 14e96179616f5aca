import numpy as np
import pytest
from gymnasium.wrappers import FrameStackObservation

from socnav_env.config import EnvConfig
from socnav_env.env import SocNavEnv
from socnav_env.observations import OBSERVATIONS, make_observation
from socnav_env.vector.env import SocNavVectorEnv


@pytest.mark.parametrize("name", OBSERVATIONS)
def test_observations_lie_in_their_space_and_share_no_memory(name: str) -> None:
    env = SocNavEnv(reward="sparse", observation=name)
    env.action_space.seed(0)
    previous: list[np.ndarray] = []
    for seed in range(10):
        seen = [env.reset(seed=seed)[0], *(env.step(env.action_space.sample())[0] for _ in range(3))]
        for each in seen:
            assert env.observation_space.contains(each)
            parts = list(each.values()) if isinstance(each, dict) else [each]
            assert not any(np.shares_memory(part, old) for part in parts for old in previous)
            previous = parts


@pytest.mark.parametrize("name", OBSERVATIONS)
def test_vectors_of_worlds_see_what_single_ones_do(name: str) -> None:
    envs = SocNavVectorEnv(2, reward="sparse", observation=name)
    single = SocNavEnv(reward="sparse", observation=name)
    seen, one = envs.reset(seed=4)[0], single.reset(seed=5)[0]
    for _ in range(4):
        if isinstance(one, dict):
            assert all(np.array_equal(seen[key][1], one[key]) for key in one)
            assert set(seen) == set(one)
        else:
            assert np.array_equal(seen[1], one)
        seen, one = envs.step(np.full((2, 2), 0.7))[0], single.step(np.full(2, 0.7))[0]


@pytest.mark.parametrize("name", OBSERVATIONS)
def test_past_observations_are_stacked_by_gymnasium(name: str) -> None:
    single = SocNavEnv(reward="sparse", observation=name)
    env = FrameStackObservation(SocNavEnv(reward="sparse", observation=name), 3)
    first, _ = env.reset(seed=2)
    assert env.observation_space.contains(first)
    seen = [single.reset(seed=2)[0]]
    for _ in range(3):
        stacked = env.step(np.ones(2))[0]
        seen.append(single.step(np.ones(2))[0])
    assert env.observation_space.contains(stacked)
    for age in range(3):
        then = seen[-1 - age]
        if isinstance(then, dict):
            assert all(np.array_equal(stacked[key][-1 - age], then[key]) for key in then)
        else:
            assert np.array_equal(stacked[-1 - age], then)


def test_an_unknown_name_is_answered_with_the_valid_ones() -> None:
    with pytest.raises(
        ValueError,
        match="must be one of entities, flat, lidar, graph or an Observation object, got 'entity'",
    ):
        make_observation("entity", EnvConfig())


def test_what_is_not_an_observation_is_refused() -> None:
    with pytest.raises(ValueError, match=r"an object with space\(\) and observe\(world, time_left\), got int"):
        make_observation(3, EnvConfig())
