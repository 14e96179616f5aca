"""Every scenario that ships, as users meet it."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from socnav_env import scenarios
from socnav_env.commands.main import main
from socnav_env.config import EnvConfig, PopulationConfig
from socnav_env.config.checks import ConfigError
from socnav_env.env import SocNavEnv, action_of
from socnav_env.layout import Layout
from socnav_env.recording.files import RecordTrajectory, read_recording, record_episode
from socnav_env.recording.replay import first_difference, replay
from socnav_env.simulated_data.drivers import DRIVERS

NAMED = (
    "blind_corner",
    "couple_towards",
    "crossing_crowd",
    "crowded_small_room",
    "frontal_approach",
    "intersection",
    "narrow_passage",
    "obstructed_path",
    "person_at_laptop",
    "person_overtaking",
    "robot_overtaking",
    "standing_group_in_the_way",
)


def begin(name: str, seed: int = 0) -> SocNavEnv:
    env = SocNavEnv("sparse", scenario=name)
    env.reset(seed=seed)
    return env


def digest(name: str, episodes: int, steps: int) -> str:
    """A hash over everything that happens in some episodes of a scenario."""
    env, hashed = SocNavEnv("sparse", scenario=name), hashlib.sha256()
    for seed in range(episodes):
        observation, _ = env.reset(seed=seed)
        random = np.random.default_rng(seed)
        driver = list(DRIVERS.values())[seed % len(DRIVERS)](random)
        for _ in range(steps):
            for part in observation.values():
                hashed.update(part.tobytes())
            action = action_of(driver.command(env.world, random), env.config.robot)
            observation, reward, terminated, truncated, _ = env.step(action)
            hashed.update(np.float64(reward).tobytes())
            if terminated or truncated:
                break
    return hashed.hexdigest()


def test_the_named_scenarios_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert scenarios.names() == NAMED
    assert main(["scenarios"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(NAMED)
    assert all(line.endswith(".") and len(line) > 60 for line in lines)


@pytest.mark.parametrize("name", NAMED)
def test_a_scenario_can_be_made_by_name_and_lives(name: str) -> None:
    env = gym.make("SocNav2-v0", reward="sparse", scenario=name)
    default = gym.make("SocNav2-v0", reward="sparse")
    assert env.observation_space == default.observation_space  # an agent trained elsewhere fits
    assert env.action_space == default.action_space
    observation, _ = env.reset(seed=1)
    assert env.observation_space.contains(observation)
    world = env.unwrapped.world
    assert world.clearance_to_people().min() > 0
    assert world.clearance_to_walls().min() > 0
    before = world.people_poses
    for _ in range(20):
        assert env.step(np.zeros(2, dtype=np.float32))[4]["outcome"] in (None, "collision_person")
        if world.contacts.person:
            break
    moved = np.hypot(*(world.people_poses - before)[:, :2].T) > 0.05
    assert moved[~world.layout.people_walk].sum() == 0
    assert not world.layout.people_walk.any() or moved.any()


@pytest.mark.parametrize("name", NAMED)
def test_seeds_vary_the_details_and_nothing_else(name: str) -> None:
    one, again, other = (begin(name, seed).world for seed in (3, 3, 4))
    np.testing.assert_array_equal(one.people_poses, again.people_poses)
    np.testing.assert_array_equal(one.robot_pose, again.robot_pose)
    assert not np.array_equal(one.robot_pose, other.robot_pose)
    assert len(one.layout.room.corners) == len(other.layout.room.corners)


@pytest.mark.parametrize("name", NAMED)
def test_episodes_begin_exactly_where_the_script_ends(name: str) -> None:
    world = begin(name).world
    np.testing.assert_array_equal(world.people_poses, world.layout.people_poses)
    np.testing.assert_array_equal(world.robot_pose, world.layout.robot_pose)


@pytest.mark.parametrize("name", ["blind_corner", "crowded_small_room", "couple_towards"])
def test_recordings_of_scenarios_carry_all_and_replay(name: str, tmp_path: Path) -> None:
    env = RecordTrajectory(SocNavEnv("sparse", scenario=name), tmp_path)
    env.reset(seed=2)
    random = np.random.default_rng(2)
    for _ in range(40):
        if any(env.step(random.uniform(-0.3, 1.0, 2))[2:4]):
            break
    env.close()
    recording = read_recording(tmp_path / "episode-000000.npz")
    assert recording.trajectory.layout.script is not None
    assert first_difference(recording.trajectory, replay(recording)) is None


def test_worlds_of_a_vector_go_the_ways_of_single_ones() -> None:
    envs = gym.make_vec(
        "SocNav2-v0", num_envs=3, vectorization_mode="vector_entry_point", reward="sparse", scenario="crossing_crowd"
    )
    envs.reset(seed=5)
    singles = [begin("crossing_crowd", seed) for seed in (5, 6, 7)]
    for _ in range(5):
        envs.step(np.full((3, 2), 0.5, dtype=np.float32))
        for single in singles:
            single.step(np.full(2, 0.5))
    for world, single in zip(envs.unwrapped.envs, singles, strict=True):
        np.testing.assert_array_equal(world.world.people_poses, single.world.people_poses)


def test_a_scenario_outweighs_the_configuration_where_it_says_something() -> None:
    config = EnvConfig(time_limit=20.0, population=PopulationConfig(still=(0, 1)))
    env = SocNavEnv("sparse", config=config, scenario="frontal_approach")
    assert (env.config.time_limit, env.config.people.stop_distance) == (60.0, 0.0)
    assert env.config.population == config.population


def test_a_scenario_object_will_do() -> None:
    class Empty:
        name, description = "empty", "Nobody."

        def adapt(self, config: EnvConfig) -> EnvConfig:
            return config

        def draw(self, config: EnvConfig, rng: np.random.Generator) -> Layout:
            layout = begin("frontal_approach").world.layout
            return layout

    assert SocNavEnv("sparse", scenario=Empty()).scenario.name == "empty"
    with pytest.raises(ConfigError, match="scenario must be a name, a file or a Scenario, got int"):
        SocNavEnv("sparse", scenario=3)


def test_an_unknown_name_is_answered_with_the_known_ones() -> None:
    with pytest.raises(ConfigError, match=r"scenario must be one of blind_corner, .*, or a file .* got 'moon'"):
        SocNavEnv("sparse", scenario="moon")


def test_episodes_are_the_same_bits_in_another_process() -> None:
    names = ("crossing_crowd", "narrow_passage", "crowded_small_room")
    program = (
        "from tests.socnav_env.scenarios.test_scenarios import digest\n"
        f"print(*[digest(name, 2, 25) for name in {names}])"
    )
    answer = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=Path(__file__).parents[3]
    )
    assert answer.stdout.split() == [digest(name, 2, 25) for name in names]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMED)
def test_fifty_episodes_are_the_same_bits_in_another_process(name: str) -> None:
    program = f"from tests.socnav_env.scenarios.test_scenarios import digest\nprint(digest({name!r}, 50, 300))"
    answer = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=Path(__file__).parents[3]
    )
    assert answer.stdout.strip() == digest(name, 50, 300)


@pytest.mark.slow
def test_a_hundred_recorded_episodes_replay_bit_for_bit(tmp_path: Path) -> None:
    places = [*NAMED, None]
    files = []
    for number in range(100):
        env = RecordTrajectory(SocNavEnv("sparse", scenario=places[number % len(places)]), tmp_path, f"run{number}")
        env.reset(seed=number)
        random = np.random.default_rng(number)
        driver = list(DRIVERS.values())[number % len(DRIVERS)](random)
        while record_episode(env).trajectory.outcome is None:
            env.step(action_of(driver.command(env.unwrapped.world, random), env.unwrapped.config.robot))
        env.close()
        files += sorted(tmp_path.glob(f"run{number}-*.npz"))
    assert len(files) == 100
    assert main(["replay", *map(str, files)]) == 0
