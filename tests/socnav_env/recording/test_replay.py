import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from reward_model.graph.windows import sequence_frames
from reward_model.scenes.socnav2_json import read_socnav2, write_socnav2
from reward_model.scenes.time_scale import slowed
from socnav_env.config import EnvConfig, PopulationConfig, RewardConfig, RobotConfig
from socnav_env.env import SocNavEnv
from socnav_env.metrics import episode_metrics
from socnav_env.recording.arrays import RecordingError
from socnav_env.recording.files import Recording, RecordTrajectory, read_recording, record_episode, write_recording
from socnav_env.recording.replay import (
    first_difference,
    recorded_sequence,
    recorded_sequences,
    recorded_windows,
    replay,
    rerun_without_robot,
)
from tests.socnav_env.recording.test_files import play

QUICK = EnvConfig(time_limit=8.0)


@pytest.fixture(scope="module")
def recording() -> Recording:
    env = SocNavEnv(reward="sparse", config=QUICK)
    play(env, "chaser", seed=4)
    return record_episode(env)


@pytest.mark.parametrize(
    ("driver", "seed"), [("goal", 0), ("polite", 1), ("chaser", 2), ("reverser", 3), ("joystick", 4)]
)
def test_what_was_recorded_happens_again_bit_for_bit(driver: str, seed: int, tmp_path: Path) -> None:
    env = RecordTrajectory(SocNavEnv(reward="sparse", config=QUICK), tmp_path)
    env.reset(seed=99)  # so that not only the first world of a generator is repeated
    env.step(np.zeros(2))
    info = play(env, driver, seed)
    recording = read_recording(tmp_path / "episode-000001.npz")
    repeated = replay(recording)
    assert first_difference(recording.trajectory, repeated) is None
    assert repeated.outcome == info["outcome"]
    np.testing.assert_array_equal(repeated.robot_poses, recording.trajectory.robot_poses)


def test_an_episode_in_the_middle_of_a_generators_life_is_repeated(tmp_path: Path) -> None:
    env = RecordTrajectory(SocNavEnv(reward="crowdnav", config=EnvConfig(time_limit=2.0)), tmp_path)
    env.reset(seed=5)
    for _ in range(25):
        *_, terminated, truncated, _ = env.step(np.array([1.0, 0.3]))
        if terminated or truncated:
            env.reset()
    files = sorted(tmp_path.iterdir())
    assert len(files) >= 2
    for file in files:
        recording = read_recording(file)
        assert first_difference(recording.trajectory, replay(recording)) is None


def test_a_holonomic_robot_with_noise_and_inertia_is_repeated_bit_for_bit(tmp_path: Path) -> None:
    robot = RobotConfig(drive="holonomic", max_acceleration=0.5, speed_noise=0.02, turn_noise=0.1)
    env = RecordTrajectory(SocNavEnv(reward="sparse", config=EnvConfig(time_limit=3.0, robot=robot)), tmp_path)
    env.action_space.seed(0)
    env.reset(seed=2)
    for _ in range(12):
        env.step(env.action_space.sample())
    env.close()
    recording = read_recording(tmp_path / "episode-000000.npz")
    assert np.abs(recording.trajectory.commands).min(axis=0).all()
    assert first_difference(recording.trajectory, replay(recording)) is None
    sideways = recorded_sequence(recording, "scene").last.command[1]
    assert sideways == recording.trajectory.commands[-1, 1]


def test_the_first_difference_is_found_down_to_the_last_bit(recording: Recording) -> None:
    poses = recording.trajectory.robot_poses.copy()
    poses[7, 1] = np.nextafter(poses[7, 1], np.inf)
    poses[9] += 1.0
    changed = replace(recording.trajectory, robot_poses=poses)
    difference = first_difference(changed, replay(recording))
    assert difference is not None
    assert (difference.step, difference.what) == (7, "robot_poses")
    recorded, repeated = float(poses[7, 1]), float(recording.trajectory.robot_poses[7, 1])
    assert str(difference) == f"robot_poses differs first at step 7: recorded {recorded!r}, repeated {repeated!r}"


def test_another_command_leads_elsewhere(recording: Recording) -> None:
    commands = recording.trajectory.commands.copy()
    commands[5] = commands[5] * 0.5 + 0.1
    changed = replace(recording, trajectory=replace(recording.trajectory, commands=commands))
    difference = first_difference(recording.trajectory, replay(changed))
    assert difference is not None
    assert difference.step == 6


def test_another_end_is_a_difference(recording: Recording) -> None:
    trajectory = recording.trajectory
    assert first_difference(replace(trajectory, outcome=None), trajectory) is None
    difference = first_difference(trajectory, replace(trajectory, outcome=None))
    assert difference is not None
    assert (difference.step, difference.what) == (len(trajectory), "outcome")


def test_another_version_is_refused_with_one_line(recording: Recording) -> None:
    foreign = replace(recording, versions={**recording.versions, "pymunk": "6.0.0"}, name="old.npz")
    for repeat in (replay, rerun_without_robot, lambda each: recorded_sequence(each, "scene")):
        with pytest.raises(RecordingError) as refused:
            repeat(foreign)
        assert str(refused.value).startswith("old.npz: must be simulated by the versions that recorded it, ")
        assert "pymunk 6.0.0" in str(refused.value)
        assert "\n" not in str(refused.value)


def test_without_the_robot_nobody_is_held_up(recording: Recording) -> None:
    free = rerun_without_robot(recording)
    assert len(free) == len(recording.trajectory)
    assert free.person_distances.min() > 900
    np.testing.assert_array_equal(free.people_poses[:, ~free.layout.people_walk, :2],
                                  recording.trajectory.people_poses[:, ~free.layout.people_walk, :2])  # fmt: skip
    metrics = episode_metrics(recording.trajectory, free)
    assert np.isfinite(metrics["person_delay"])
    assert np.isfinite(metrics["person_detour"])


def test_a_robot_that_stands_in_the_way_delays_people() -> None:
    crowd = PopulationConfig(still=(0, 0), wandering=(4, 4), tables=(0, 0), plants=(0, 0), interactions=(0, 0))
    delays = []
    for seed in range(6):
        env = SocNavEnv(reward="sparse", config=EnvConfig(time_limit=8.0, population=crowd))
        play(env, "stander", seed)
        recording = record_episode(env)
        delays.append(episode_metrics(recording.trajectory, rerun_without_robot(recording))["person_delay"])
    assert np.nanmin(delays) > -0.5
    assert np.nanmean(delays) > 0.1


def test_an_export_is_the_scene_that_was_judged(feature_reward, feature_scorer, tmp_path: Path) -> None:
    env = SocNavEnv(reward=feature_reward, config=EnvConfig(time_limit=1.0))
    env.reset(seed=3)
    windows = []
    for _ in range(5):
        env.step(np.array([0.8, 0.2]))
        windows.append(env.window())
    recording = record_episode(env)
    for window, again in zip(windows, recorded_windows(recording), strict=True):
        for frame, other in zip(window, again, strict=True):
            np.testing.assert_array_equal(frame.arrays.features, other.arrays.features)
    sequence = recorded_sequence(recording, "scene")
    assert len(sequence) == 1 + 10 + 5
    assert [sequence.snapshots[index].timestamp for index in (0, 10, 15)] == pytest.approx([-2.0, 0.0, 1.0])
    np.testing.assert_array_equal(sequence.last.robot_pose, recording.trajectory.robot_poses[-1])
    write_socnav2(sequence, tmp_path / "scene.json")
    read = read_socnav2(tmp_path / "scene.json")
    assert len(read) == 16
    np.testing.assert_allclose(read.last.people.velocities, sequence.last.people.velocities, atol=1e-12)


def test_a_slowed_recording_is_judged_as_it_was_and_exported_in_real_time(feature_reward, tmp_path: Path) -> None:
    config = EnvConfig(time_limit=2.0, reward=RewardConfig(time_scale=2.5))
    env = SocNavEnv(feature_reward, config=config)
    env.reset(seed=3)
    windows = []
    for _ in range(10):
        env.step(np.array([0.8, 0.2]))
        windows.append(env.window())
    write_recording(record_episode(env), tmp_path / "episode.npz")
    recording = read_recording(tmp_path / "episode.npz")
    assert recording.config == config
    scored = [sequence_frames(sequence) for sequence in recorded_sequences(recording)[1:]]
    exported = sequence_frames(slowed(recorded_sequence(recording, "scene"), 2.5))
    assert recorded_sequence(recording, "scene").last.timestamp == pytest.approx(2.0)
    pairs = [*zip(recorded_windows(recording), windows, strict=True), *zip(scored, windows, strict=True)]
    for window, expected in [*pairs, (exported, windows[-1])]:
        for frame, other in zip(window, expected, strict=True):
            np.testing.assert_array_equal(frame.arrays.features, other.arrays.features)


def test_another_process_repeats_the_same_bits(recording: Recording, tmp_path: Path) -> None:
    write_recording(recording, tmp_path / "episode.npz")
    command = [sys.executable, "-m", "socnav_env", "replay", str(tmp_path / "episode.npz")]
    answer = subprocess.run(command, capture_output=True, text=True, check=False)
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout == f"{tmp_path / 'episode.npz'}: identical, {len(recording.trajectory)} steps\n"
