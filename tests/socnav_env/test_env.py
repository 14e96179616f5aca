import subprocess
import sys
import zlib

import gymnasium as gym
import numpy as np
import pytest

import socnav_env
from reward_model.scenes.scene import SceneSequence
from socnav_env.config import EnvConfig, PopulationConfig, RobotConfig
from socnav_env.env import SocNavEnv
from socnav_env.metrics import METRICS
from socnav_env.rewards import REWARDS, SparseReward
from socnav_env.trajectories.outcomes import Outcome

NOBODY = PopulationConfig(still=(0, 0), wandering=(0, 0), tables=(0, 0), plants=(0, 0), interactions=(0, 0))
FORWARD, BACKWARD, STAND = np.array([1.0, 0.0]), np.array([-1.0, 0.0]), np.zeros(2)


def make(**arguments) -> gym.Env:
    return gym.make("SocNav2-v0", **arguments)


def towards_goal(env: gym.Env, observation: dict[str, np.ndarray]) -> np.ndarray:
    bearing = float(np.arctan2(observation["goal"][1], observation["goal"][0]))
    return np.array([float(abs(bearing) < 0.3), np.clip(4 * bearing, -1, 1)])


def play(env: gym.Env, seed: int, policy=towards_goal) -> list[tuple]:
    """One episode: what each step returned."""
    observation, _ = env.reset(seed=seed)
    steps = [env.step(policy(env, observation))]
    while not (steps[-1][2] or steps[-1][3]):
        steps.append(env.step(policy(env, steps[-1][0])))
    return steps


def digest_of(reward: str, seed: int, num_steps: int) -> int:
    """A number that changes with any bit of a random episode."""
    env = make(reward=reward)
    observation, _ = env.reset(seed=seed)
    random, digest = np.random.default_rng(seed), 0
    for _ in range(num_steps):
        for key in sorted(observation):
            digest = zlib.crc32(observation[key].tobytes(), digest)
        observation, reward_value, terminated, truncated, _ = env.step(random.uniform(-1, 1, 2))
        digest = zlib.crc32(np.float64(reward_value).tobytes(), digest)
        if terminated or truncated:
            observation, _ = env.reset()
    return digest


@pytest.mark.usefixtures("without_weights")
@pytest.mark.parametrize("reward", REWARDS)
def test_terms_add_up_to_the_reward_and_have_weights(reward: str) -> None:
    env = make(reward=reward)
    judged = env.unwrapped.reward.scorer is not None
    for _, value, _, _, info in play(env, seed=3):
        assert sum(info["reward_terms"].values()) == value
        assert set(info["reward_terms"]) == set(info["reward_weights"])
        assert ("q1" in info, "q2" in info) == (judged, judged)


def test_the_learned_reward_is_what_is_missing_to_a_perfect_score(feature_reward, feature_scorer) -> None:
    steps = play(make(reward=feature_reward), seed=3)
    for _, value, terminated, _, info in steps:
        if not terminated:
            assert value == pytest.approx((info["q2"] - 1) * 0.2)
    assert len(feature_scorer.lengths) == len(steps)
    assert set(feature_scorer.lengths) == {3}  # the very first step is judged on three frames


def test_the_published_network_judges_what_was_recorded(published_weights) -> None:
    from reward_model.scorer import load_scorer

    env = make(reward="q2", weights="published")
    env.reset(seed=1)
    for _ in range(7):
        _, value, _, _, info = env.step(FORWARD)
        scene = SceneSequence(env.unwrapped._episode._recorder.snapshots)
        expected = load_scorer("published").score(scene)
        assert (info["q1"], info["q2"]) == pytest.approx(expected[:2], abs=1e-5)
        assert value == info["q2"]
    assert make(reward="q2", weights="published").unwrapped.reward.scorer is env.unwrapped.reward.scorer


@pytest.mark.parametrize("reward", ["crowdnav", "sparse"])
def test_the_same_seed_gives_the_same_bits_in_another_process(reward: str) -> None:
    program = f"from tests.socnav_env.test_env import digest_of; print(digest_of({reward!r}, 11, 150))"
    answer = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert int(answer.stdout) == digest_of(reward, 11, 150)


def test_a_seed_says_everything_whatever_was_played_before() -> None:
    env = make(reward="sparse")
    first = [step[0] for step in play(env, seed=5)]
    play(env, seed=6)
    again = [step[0] for step in play(env, seed=5)]
    assert len(first) == len(again)
    for one, other in zip(first, again, strict=True):
        assert all(np.array_equal(one[key], other[key]) for key in one)


def test_first_observations_differ_between_seeds_and_between_episodes() -> None:
    env = make(reward="sparse")
    starts = [env.reset(seed=seed)[0]["goal"] for seed in range(10)] + [env.reset()[0]["goal"] for _ in range(10)]
    assert len({start.tobytes() for start in starts}) == 20


def test_global_randomness_is_neither_used_nor_set() -> None:
    np.random.seed(0)  # noqa: NPY002 - the global state is what is tested
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    play(make(reward="sparse"), seed=2)
    np.testing.assert_array_equal(before, np.random.get_state()[1])  # noqa: NPY002


def test_a_robot_in_an_empty_room_arrives() -> None:
    config = EnvConfig(population=NOBODY)
    steps = play(make(reward="sparse", config=config), seed=1)
    _, value, terminated, truncated, info = steps[-1]
    assert (value, terminated, truncated) == (50.0, True, False)
    assert (info["outcome"], info["is_success"]) == ("arrived", True)
    assert info["episode_metrics"]["time_to_goal"] == pytest.approx(len(steps) * 0.2)
    assert all(step[1] == 0.0 and step[4]["outcome"] is None for step in steps[:-1])


def test_driving_on_ends_at_a_wall() -> None:
    config = EnvConfig(population=NOBODY, robot=RobotConfig(arrival_radius=0.01))
    steps = play(make(reward="sparse", config=config), seed=1, policy=lambda env, observation: FORWARD)
    _, value, terminated, truncated, info = steps[-1]
    assert (value, terminated, truncated, info["outcome"]) == (-50.0, True, False, "collision_wall")
    assert not info["is_success"]


def test_standing_runs_out_of_time() -> None:
    config = EnvConfig(time_limit=3.0)
    steps = play(make(reward="sparse", config=config), seed=1, policy=lambda env, observation: STAND)
    _, value, terminated, truncated, info = steps[-1]
    assert (value, terminated, truncated, info["outcome"]) == (0.0, False, True, "timeout")
    assert len(steps) == 15
    np.testing.assert_allclose([step[0]["robot"][3] for step in steps], 1 - np.arange(1, 16) / 15, atol=1e-6)


def test_every_measure_is_in_the_last_info_and_in_no_other() -> None:
    steps = play(make(reward="crowdnav"), seed=4)
    assert set(steps[-1][4]["episode_metrics"]) == set(METRICS)
    assert not any("episode_metrics" in step[4] for step in steps[:-1])


def test_after_the_end_a_reset_is_asked_for() -> None:
    env = make(reward="sparse", config=EnvConfig(time_limit=0.2)).unwrapped
    with pytest.raises(gym.error.ResetNeeded, match=r"there is no scene yet, call reset\(\) first"):
        env.step(STAND)
    env.reset(seed=1)
    env.step(STAND)
    with pytest.raises(gym.error.ResetNeeded, match=r"the episode has ended \(timeout\), call reset\(\)"):
        env.step(STAND)


@pytest.mark.parametrize(
    "action",
    [np.zeros(3), np.zeros((1, 2)), 0.5, [np.nan, 0.0], [0.0, np.inf], None, []],
    ids=["three", "nested", "number", "nan", "infinite", "none", "empty"],
)
def test_an_action_that_is_not_two_numbers_is_refused_and_changes_nothing(action) -> None:
    env = make(reward="sparse").unwrapped
    env.reset(seed=1)
    with pytest.raises(ValueError, match=r"^action must be two finite numbers \(forward, turn\), got [^\n]*$"):
        env.step(action)
    _, _, _, _, info = env.step(STAND)
    assert info["outcome"] is None


def test_an_action_is_not_written_to() -> None:
    action = np.array([3.0, -3.0])
    env = make(reward="sparse").unwrapped
    env.reset(seed=1)
    env.step(action)
    np.testing.assert_array_equal(action, [3.0, -3.0])


def test_positive_turns_go_to_the_left() -> None:
    env = make(reward="sparse", config=EnvConfig(population=NOBODY)).unwrapped
    before, _ = env.reset(seed=1)
    after = env.step(np.array([0.0, 1.0]))[0]
    bearing = np.arctan2(*after["goal"][::-1]) - np.arctan2(*before["goal"][::-1])
    assert np.angle(np.exp(1j * bearing)) == pytest.approx(-0.2 * 4 / 10.32, abs=1e-3)
    assert after["robot"][2] == pytest.approx(4 / 10.32, abs=1e-3)


@pytest.mark.parametrize(
    ("robot", "rated"),
    [
        (RobotConfig(), True),
        (RobotConfig(max_forward_speed=0.38), False),
        (RobotConfig(max_backward_speed=0.5), False),
        (RobotConfig(max_turn_rate=0.4), False),
        (RobotConfig(max_sideways_speed=9.9), True),
        (RobotConfig(drive="holonomic"), False),
        (RobotConfig(max_forward_speed=0.1, max_backward_speed=0.0, max_turn_rate=0.1), True),
    ],
)
def test_info_says_whether_people_rated_such_a_robot(robot: RobotConfig, rated: bool) -> None:
    assert robot.in_rated_range is rated
    env = make(reward="sparse", config=EnvConfig(robot=robot))
    assert env.reset(seed=1)[1]["in_rated_range"] is rated
    assert env.step(np.zeros_like(env.action_space.sample()))[4]["in_rated_range"] is rated


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"reward": "learnt"}, "reward must be one of learned, q1, q2, crowdnav, dsrnn, sparse, mix"),
        ({"reward": "sparse", "observation": "pixels"}, "observation must be one of entities, flat, lidar, graph"),
        ({"reward": "sparse", "render_mode": "ascii"}, "render_mode must be None or one of rgb_array, human"),
    ],
)
def test_unknown_names_are_answered_with_the_valid_ones(arguments: dict[str, str], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        SocNavEnv(**arguments)


def test_options_of_reset_are_refused() -> None:
    with pytest.raises(ValueError, match="reset has no options, got scene"):
        make(reward="sparse").unwrapped.reset(options={"scene": 1})


def test_a_reward_of_ones_own_is_used() -> None:
    reward = SparseReward({"arrival": 3.0, "contact": -2.0})
    env = make(reward=reward, config=EnvConfig(population=NOBODY))
    assert play(env, seed=1)[-1][1] == 3.0


def test_many_environments_in_one_vector() -> None:
    envs = gym.make_vec("SocNav2-v0", num_envs=3, reward="sparse", config=EnvConfig(time_limit=0.6))
    observations, _ = envs.reset(seed=1)
    assert observations["people"].shape[0] == 3
    for _ in range(3):
        _, _, terminated, truncated, info = envs.step(np.zeros((3, 2), dtype=np.float32))
    assert (terminated | truncated).all()
    assert list(info["outcome"]) == ["timeout"] * 3
    assert info["episode_metrics"]["timeout"].tolist() == [1.0] * 3


def test_people_who_do_not_see_the_robot_do_not_end_an_episode_before_it_begins() -> None:
    from dataclasses import replace

    config = EnvConfig()
    config = replace(config, people=replace(config.people, robot_visibility=0.0))
    env = make(reward="sparse", config=config).unwrapped
    for seed in range(20):
        env.reset(seed=seed)
        assert not env._episode.world.contacts


@pytest.mark.parametrize(
    "changes",
    [{"control_period": 0.1}, {"control_period": 0.05}, {"control_period": 0.5, "warm_up": 3.0}, {"warm_up": 0.0}],
)
def test_other_clocks_work(changes: dict[str, float], feature_reward, feature_scorer) -> None:
    config = EnvConfig(time_limit=4.0, **changes)
    env = make(reward=feature_reward, config=config)
    steps = play(env, seed=2, policy=lambda env, observation: STAND)
    assert len(steps) == round(4.0 / config.control_period)
    assert env.metadata["render_fps"] == pytest.approx(1 / config.control_period)
    expected = 3 if config.warm_up else 1
    assert feature_scorer.lengths[0] == expected


def test_importing_the_package_is_light() -> None:
    heavy = ("torch", "dgl", "numba", "pymunk", "pygame", "scipy", "stable_baselines3")
    program = f"import sys, socnav_env; sys.exit(' '.join(name for name in {heavy} if name in sys.modules) or None)"
    answer = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (answer.returncode, answer.stderr) == (0, "")
    assert socnav_env.EnvConfig is EnvConfig


def test_outcomes_in_info_are_plain_text() -> None:
    info = play(make(reward="sparse", config=EnvConfig(time_limit=0.2)), seed=1)[-1][4]
    assert type(info["outcome"]) is str
    assert info["outcome"] in set(Outcome)
