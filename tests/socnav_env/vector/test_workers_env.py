import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from socnav_env.config import EnvConfig
from socnav_env.rewards import SparseReward
from socnav_env.vector.env import SocNavVectorEnv
from socnav_env.vector.workers_env import SocNavWorkerVectorEnv
from tests.socnav_env.vector.test_env import GoalOnly, assert_same, play

SHORT = EnvConfig.from_dict({"time_limit": 1.4, "robot": {"max_forward_speed": 4.0}})  # some touch something
NUM_ENVS = 3
STAND = np.zeros((NUM_ENVS, 2), dtype=np.float32)


@pytest.fixture
def make():
    made = []

    def make(mode=AutoresetMode.NEXT_STEP, num_workers=2, **arguments) -> SocNavWorkerVectorEnv:
        arguments = {"reward": "crowdnav", "config": SHORT, "autoreset_mode": mode, **arguments}
        made.append(gym.make_vec("SocNav2-v0", NUM_ENVS, num_workers=num_workers, **arguments))
        return made[-1]

    yield make
    for envs in made:
        envs.close()


@pytest.mark.parametrize(
    ("mode", "observation"),
    [
        (AutoresetMode.NEXT_STEP, "entities"),
        (AutoresetMode.SAME_STEP, GoalOnly()),
        (AutoresetMode.DISABLED, "entities"),
    ],
)
def test_everything_is_what_one_process_gives(make, mode, observation) -> None:
    here = SocNavVectorEnv(NUM_ENVS, mode, reward="crowdnav", config=SHORT, observation=observation)
    there = make(mode, observation=observation)
    assert isinstance(there, SocNavWorkerVectorEnv)
    assert there.observation_space == here.observation_space
    assert there.action_space == here.action_space
    assert there.metadata == here.metadata
    expected, played = play(here, mode, 20), play(there, mode, 20)
    for step, (one, other) in enumerate(zip(played, expected, strict=True)):
        for part, (mine, theirs) in enumerate(zip(one, other, strict=True)):
            assert_same(mine, theirs, f"{step}.{part}")
    ends = [returned[2:4] for returned in played if len(returned) == 5]
    assert np.any([terminated for terminated, _ in ends])
    assert np.any([truncated for _, truncated in ends])
    if mode is AutoresetMode.DISABLED:
        with pytest.raises(gym.error.ResetNeeded, match=r"the episode of world \d has ended"):
            for _ in range(8):
                there.step(STAND)


def test_workers_judge_in_slowed_time_as_one_process_does(make) -> None:
    config = EnvConfig.from_dict({"robot": {"max_forward_speed": 1.0}, "reward": {"time_scale": 2.7}})
    mode = AutoresetMode.NEXT_STEP
    here = SocNavVectorEnv(NUM_ENVS, mode, reward="learned", config=config)
    expected, played = play(here, mode, 4), play(make(reward="learned", config=config), mode, 4)
    real_time = EnvConfig.from_dict({"robot": {"max_forward_speed": 1.0}})
    otherwise = play(SocNavVectorEnv(NUM_ENVS, mode, reward="learned", config=real_time), mode, 4)
    for one, other, different in zip(played[1:], expected[1:], otherwise[1:], strict=True):
        assert_same(one[1], other[1], "rewards")
        assert (one[1] != different[1]).any()


def test_attributes_and_methods_of_every_world(make) -> None:
    envs = make(render_mode="rgb_array")
    with pytest.raises(gym.error.ResetNeeded, match="there is no scene yet"):
        envs.step(STAND)
    with pytest.raises(gym.error.ResetNeeded, match="reset_mask must name world 1, which has no scene yet"):
        envs.reset(options={"reset_mask": np.array([True, False, False])})
    first, _ = envs.reset(seed=7)
    assert envs.np_random_seed == (7, 8, 9)
    before, *_ = envs.step(STAND + 0.5)
    after, infos = envs.reset(seed=[None, 8, None], options={"reset_mask": np.array([False, True, False])})
    assert infos["_outcome"].tolist() == [False, True, False]
    np.testing.assert_array_equal(after["robot"][[0, 2]], before["robot"][[0, 2]])
    np.testing.assert_array_equal(after["robot"][1], first["robot"][1])
    assert envs.get_attr("time_left")[1] == 1.0
    assert [picture.dtype for picture in envs.render()] == [np.uint8] * NUM_ENVS
    envs.set_attr("reward", SparseReward({"arrival": 1.0, "contact": -1.0}))
    assert [type(each) for each in envs.get_attr("reward")] == [SparseReward] * NUM_ENVS
    for bad, message in (
        (np.zeros((2, 2)), r"actions must have shape \(3, 2\), got \(2, 2\)"),
        (np.array([[0, 0], [0, np.nan], [0, 0]]), r"world 1: action must be two finite numbers .* got \[ 0\. nan\]"),
    ):
        with pytest.raises(ValueError, match=message):
            envs.step(bad)
    envs.close()
    envs.close()
    assert envs.closed


@pytest.mark.parametrize("num_workers", [0, 4])
def test_there_are_no_more_processes_than_worlds(make, num_workers: int) -> None:
    with pytest.raises(ValueError, match=f"num_workers must be from 1 to num_envs, 3, got {num_workers}"):
        make(num_workers=num_workers)


def test_what_the_worlds_refuse_is_refused_here(make) -> None:
    with pytest.raises(ValueError, match="reward must be one of"):
        make(reward="fame")
