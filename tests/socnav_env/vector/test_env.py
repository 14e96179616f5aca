from typing import ClassVar

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import socnav_env  # noqa: F401 - registers SocNav2-v0
from socnav_env.config import EnvConfig
from socnav_env.env import SocNavEnv
from socnav_env.observations import EntitiesObservation, RowObservation
from socnav_env.rewards import REWARDS, SparseReward
from socnav_env.vector.env import SocNavVectorEnv

NUM_ENVS = 3
SHORT = EnvConfig(time_limit=1.4)  # 7 steps
STAND = np.zeros((NUM_ENVS, 2), dtype=np.float32)


class GoalOnly:
    """An observation that cannot be written in place."""

    def space(self) -> gym.Space:
        return gym.spaces.Box(-20.0, 20.0, (2,), np.float32)

    def observe(self, world, time_left: float) -> np.ndarray:
        return (world.layout.goal - world.robot_pose[:2]).astype(np.float32)


def make(num_envs: int = NUM_ENVS, **arguments) -> SocNavVectorEnv:
    arguments = {"reward": "sparse", "config": SHORT, **arguments}
    return gym.make_vec("SocNav2-v0", num_envs, "vector_entry_point", **arguments)


def make_sync(mode: AutoresetMode = AutoresetMode.NEXT_STEP, **arguments) -> SyncVectorEnv:
    arguments = {"reward": "sparse", "config": SHORT, **arguments}
    return SyncVectorEnv([lambda: SocNavEnv(**arguments)] * NUM_ENVS, autoreset_mode=mode)


def random_actions(steps: int) -> np.ndarray:
    return np.random.default_rng(0).uniform(-1, 1, (steps, NUM_ENVS, 2)).astype(np.float32)


def assert_same(one, other, where: str = "") -> None:
    """The same values of the same types, whatever they are made of."""
    assert type(one) is type(other), where
    if isinstance(one, dict):
        assert set(one) == set(other), where
        for key in one:
            assert_same(one[key], other[key], f"{where}/{key}")
    elif isinstance(one, np.ndarray) and one.dtype == object:
        assert one.shape == other.shape
        for index in range(len(one)):
            assert_same(one[index], other[index], f"{where}[{index}]")
    elif isinstance(one, np.ndarray):
        assert one.dtype == other.dtype, where
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-5, err_msg=where)
    else:
        assert one == other or one is other, where


def play(envs, mode: AutoresetMode, steps: int) -> list[tuple]:
    """Everything that reset and step return; where resets are the player's, they are made at once."""
    returned = [envs.reset(seed=4)]
    for actions in random_actions(steps):
        returned.append(envs.step(actions))
        ended = returned[-1][2] | returned[-1][3]
        if mode is AutoresetMode.DISABLED and ended.any():
            returned.append(envs.reset(options={"reset_mask": ended}))
    return returned


@pytest.mark.usefixtures("without_weights")
@pytest.mark.parametrize("mode", AutoresetMode)
@pytest.mark.parametrize("reward", REWARDS)
def test_everything_is_what_single_environments_give(reward: str, mode: AutoresetMode) -> None:
    config = EnvConfig.from_dict({"time_limit": 1.4, "robot": {"max_forward_speed": 4.0}})  # some touch something
    expected = play(make_sync(mode, reward=reward, config=config), mode, 20)
    played = play(make(reward=reward, autoreset_mode=mode, config=config), mode, 20)
    assert len(played) == len(expected)
    for step, (one, other) in enumerate(zip(played, expected, strict=True)):
        for part, (mine, theirs) in enumerate(zip(one, other, strict=True)):
            assert_same(mine, theirs, f"{step}.{part}")
    ends = [returned[2:4] for returned in played if len(returned) == 5]
    assert np.any([terminated for terminated, _ in ends])
    assert np.any([truncated for _, truncated in ends])


@pytest.mark.usefixtures("without_weights")
def test_worlds_in_slowed_time_are_judged_as_single_ones() -> None:
    config = EnvConfig.from_dict({"robot": {"max_forward_speed": 1.0}, "reward": {"time_scale": 2.7}})
    arguments = {"reward": "learned", "observation": "graph", "config": config}
    expected = play(make_sync(AutoresetMode.NEXT_STEP, **arguments), AutoresetMode.NEXT_STEP, 6)
    played = play(make(**arguments), AutoresetMode.NEXT_STEP, 6)
    for step, (one, other) in enumerate(zip(played, expected, strict=True)):
        for part, (mine, theirs) in enumerate(zip(one, other, strict=True)):
            assert_same(mine, theirs, f"{step}.{part}")
    assert played[-1][-1]["in_rated_range"].tolist() == [True] * 3


def test_infos_have_masks_and_end_with_metrics() -> None:
    envs = make(autoreset_mode="SameStep")
    _, infos = envs.reset(seed=1)
    assert infos["outcome"].tolist() == [None] * 3
    assert infos["_outcome"].tolist() == [True] * 3
    for _ in range(7):
        _, _, _, truncations, infos = envs.step(STAND)
    assert truncations.tolist() == [True] * 3
    assert infos["final_info"]["outcome"].tolist() == ["timeout"] * 3
    assert infos["final_info"]["episode_metrics"]["timeout"].tolist() == [1.0] * 3
    assert infos["final_obs"][2]["robot"][3] == 0.0
    assert infos["outcome"].tolist() == [None] * 3


def test_a_world_goes_its_own_way_whoever_else_is_there() -> None:
    envs = make(config=EnvConfig(), reward="crowdnav")
    observations, _ = envs.reset(seed=[11, 5, 8])
    single = gym.make("SocNav2-v0", reward="crowdnav")
    observation, _ = single.reset(seed=5)
    for actions in random_actions(40):
        assert all(np.array_equal(observations[key][1], observation[key]) for key in observation)
        observations, rewards, terminations, _, _ = envs.step(actions)
        observation, reward, terminated, _, _ = single.step(actions[1])
        assert (rewards[1], terminations[1]) == (reward, terminated)
        if terminated:
            break


def test_one_call_judges_all_worlds(feature_reward, feature_scorer) -> None:
    calls = []
    score = feature_scorer.score_windows
    feature_scorer.score_windows = lambda windows: calls.append(len(windows)) or score(windows)
    envs = make(reward=feature_reward)
    envs.reset(seed=0)
    for _ in range(8):
        envs.step(STAND)
    assert calls == [3] * 7  # in the eighth step all begin anew


@pytest.mark.parametrize("mix", ["learned+q1+0.5*crowdnav", {"learned": 1.0, "q1": 1.0, "crowdnav": 0.5}])
@pytest.mark.usefixtures("without_weights")
def test_a_mix_is_scored_once_a_step(mix, feature_scorer, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    score = feature_scorer.score_windows
    monkeypatch.setattr(feature_scorer, "score_windows", lambda windows: calls.append(len(windows)) or score(windows))
    envs = make(reward=mix)
    envs.reset(seed=0)
    for _ in range(3):
        _, rewards, _, _, infos = envs.step(STAND)
    assert calls == [3] * 3
    terms = infos["reward_terms"]
    assert np.allclose(terms["learned.social"] + terms["q1.q1"] + terms["crowdnav.discomfort"], rewards)


class Hurry:
    """A reward of somebody's own: each second costs, in an L more."""

    scorer = None
    weights: ClassVar = {"time": -0.5}

    def terms(self, moment) -> dict[str, float]:
        return {"time": moment.duration * len(moment.world.layout.room.corners)}


def test_a_reward_of_ones_own_is_used_in_every_world() -> None:
    envs, single = make(reward=Hurry(), config=EnvConfig()), gym.make("SocNav2-v0", reward=Hurry())
    envs.reset(seed=5)
    single.reset(seed=6)
    _, rewards, _, _, infos = envs.step(STAND)
    _, reward, _, _, info = single.step(STAND[1])
    assert rewards[1] == reward == info["reward_terms"]["time"]
    assert reward in (pytest.approx(-0.4), pytest.approx(-0.6))
    assert infos["reward_weights"]["time"].tolist() == [-0.5] * 3


def test_spaces_are_those_of_one_environment_batched() -> None:
    envs, expected = make(), make_sync()
    assert envs.single_observation_space == expected.single_observation_space
    assert envs.observation_space == expected.observation_space
    assert envs.single_action_space == expected.single_action_space
    assert envs.action_space == expected.action_space
    observations, _ = envs.reset(seed=0)
    assert envs.observation_space.contains(observations)
    assert envs.observation_space.contains(envs.step(envs.action_space.sample())[0])


@pytest.mark.parametrize("observation", ["entities", GoalOnly()])
def test_what_is_returned_shares_no_memory_with_anything(observation) -> None:
    envs = make(observation=observation, autoreset_mode="SameStep", num_envs=1)
    returned = [envs.reset(seed=0)[0]]
    for _ in range(8):
        seen, *arrays, infos = envs.step(np.zeros((1, 2)))
        returned += [seen, *arrays, infos.get("final_obs", np.zeros(1))]
    parts = [part for each in returned for part in (each.values() if isinstance(each, dict) else [each])]
    assert not any(np.shares_memory(a, b) for i, a in enumerate(parts) for b in parts[:i])


def test_any_observation_will_do() -> None:
    assert isinstance(EntitiesObservation(SHORT), RowObservation)
    assert not isinstance(GoalOnly(), RowObservation)
    mode = AutoresetMode.SAME_STEP
    played = play(make(observation=GoalOnly(), autoreset_mode=mode), mode, 9)
    expected = play(make_sync(mode, observation=GoalOnly()), mode, 9)
    for one, other in zip(played, expected, strict=True):
        assert_same(one[0], other[0])
    assert played[0][0].shape == (3, 2)


def test_seeds_count_upwards_from_an_int_and_a_mask_leaves_the_others_alone() -> None:
    envs = make()
    first, _ = envs.reset(seed=7)
    assert envs.np_random_seed == (7, 8, 9)
    listed, _ = envs.reset(seed=[7, 8, 9])
    assert_same(first, listed)
    envs.step(STAND + 0.5)
    before, *_ = envs.step(STAND + 0.5)
    mask = np.array([False, True, False])
    after, infos = envs.reset(seed=[None, 8, None], options={"reset_mask": mask})
    assert infos["_outcome"].tolist() == mask.tolist()
    for key in first:
        np.testing.assert_array_equal(after[key][[0, 2]], before[key][[0, 2]])
        np.testing.assert_array_equal(after[key][1], first[key][1])


def test_attributes_methods_and_pictures_of_every_world() -> None:
    envs = make(render_mode="rgb_array")
    envs.reset(seed=0)
    assert envs.get_attr("time_left") == (1.0, 1.0, 1.0)
    assert len(envs.call("window")) == 3
    other = SparseReward({"arrival": 1.0, "contact": -1.0})
    envs.set_attr("reward", other)
    assert envs.get_attr("reward") == (other,) * 3
    envs.set_attr("render_mode", [None, "rgb_array", "rgb_array"])
    assert envs.get_attr("render_mode") == (None, "rgb_array", "rgb_array")
    envs.set_attr("render_mode", "rgb_array")
    pictures = envs.render()
    assert len(pictures) == 3
    assert all(picture.dtype == np.uint8 and picture.ndim == 3 for picture in pictures)
    with pytest.raises(ValueError, match="values must be one for each of the 3 worlds, got 2"):
        envs.set_attr("reward", [other, other])
    envs.close()
    assert envs.closed
    envs.close()


def test_it_says_how_it_was_made() -> None:
    envs = make()
    assert envs.spec.id == "SocNav2-v0"
    assert envs.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert envs.metadata["render_fps"] == 5
    assert isinstance(gym.make_vec("SocNav2-v0", 2, reward="sparse"), SocNavVectorEnv)
    assert isinstance(gym.make_vec("SocNav2-v0", 2, "sync", reward="sparse"), SyncVectorEnv)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"num_envs": 0}, "num_envs must be at least 1, got 0"),
        ({"autoreset_mode": "Never"}, "autoreset_mode must be one of NextStep, SameStep, Disabled, got 'Never'"),
        ({"reward": "fame"}, "reward must be one of"),
    ],
)
def test_what_cannot_be_made_is_refused(arguments: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make(**arguments)


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        (np.zeros((2, 2)), r"actions must have shape \(3, 2\), got \(2, 2\)"),
        (np.array([[0, 0], [0, np.nan], [0, 0]]), r"world 1: action must be two finite numbers .* got \[ 0\. nan\]"),
    ],
)
def test_bad_actions_move_nobody(actions: np.ndarray, message: str) -> None:
    envs = make()
    before, _ = envs.reset(seed=0)
    with pytest.raises(ValueError, match=message):
        envs.step(actions)
    assert_same(envs.observations(), before)
    assert [world.time for world in envs.get_attr("world")] == [pytest.approx(0.0)] * 3


def test_the_action_of_a_world_that_begins_anew_does_not_matter() -> None:
    envs = make()
    envs.reset(seed=0)
    for _ in range(7):
        envs.step(STAND)
    _, rewards, terminations, truncations, _ = envs.step(np.full((3, 2), np.nan))
    assert not (rewards.any() or terminations.any() or truncations.any())


def test_without_a_scene_there_is_no_step() -> None:
    envs = make(autoreset_mode="Disabled")
    with pytest.raises(gym.error.ResetNeeded, match="there is no scene yet"):
        envs.step(STAND)
    with pytest.raises(gym.error.ResetNeeded, match="reset_mask must name world 1, which has no scene yet"):
        envs.reset(options={"reset_mask": np.array([True, False, False])})
    envs.reset(seed=0)
    for _ in range(7):
        envs.step(STAND)
    with pytest.raises(gym.error.ResetNeeded, match="the episode has ended"):
        envs.step(STAND)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"seed": [1, 2]}, ValueError, "seed must be one for each of the 3 worlds, got 2"),
        ({"options": {"room": "big"}}, ValueError, "reset has no options, got room"),
        ({"options": {"reset_mask": [True] * 3}}, TypeError, "reset_mask must be a bool array, got list"),
        ({"options": {"reset_mask": np.ones(3)}}, TypeError, "reset_mask must be a bool array, got float64"),
        ({"options": {"reset_mask": np.ones(2, bool)}}, ValueError, r"must have shape \(3,\), got \(2,\)"),
        ({"options": {"reset_mask": np.zeros(3, bool)}}, ValueError, "must name at least one world"),
    ],
)
def test_bad_resets_are_refused(arguments: dict, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        make().reset(**arguments)
