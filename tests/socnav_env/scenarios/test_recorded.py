"""Episodes that go on where a SocNav2 recording ends."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from reward_model.scenes.scene import ScenarioError
from reward_model.scenes.socnav2_json import read_socnav2, write_socnav2
from socnav_env.config.checks import ConfigError
from socnav_env.env import SocNavEnv
from socnav_env.recording.files import record_episode
from socnav_env.recording.replay import first_difference, recorded_sequence, replay
from socnav_env.trajectories.from_socnav2 import trajectory_of_sequence

SAMPLES = ("S1_000000", "S1_000003", "S2F_000000", "S2_000000", "S3I_000000", "S3nI_000000")


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of our own: the robot drives and people walk."""
    env = SocNavEnv("sparse", scenario="couple_towards")
    env.reset(seed=1)
    for _ in range(12):
        env.step(np.array([0.6, 0.1]))
    path = tmp_path_factory.mktemp("recorded") / "scene.json"
    write_socnav2(recorded_sequence(record_episode(env), "scene"), path)
    return path


def changed(file: Path, tmp_path: Path, change) -> Path:
    document = json.loads(file.read_text())
    for snapshot in document:
        change(snapshot)
    path = tmp_path / "changed.json"
    path.write_text(json.dumps(document))
    return path


def test_an_episode_begins_where_the_recording_ends(file: Path) -> None:
    env = SocNavEnv("sparse", scenario=file)
    env.reset(seed=0)
    sequence = read_socnav2(file)
    recorded = trajectory_of_sequence(sequence)
    world = env.world
    np.testing.assert_allclose(world.robot_pose, recorded.robot_poses[-1], atol=1e-9)
    turned = (world.people_poses - recorded.people_poses[-1])[:, 2] / (2 * np.pi)
    np.testing.assert_allclose(world.people_poses[:, :2], recorded.people_poses[-1, :, :2], atol=1e-9)
    np.testing.assert_allclose(turned, np.round(turned), atol=1e-9)
    np.testing.assert_allclose(world.layout.goal, recorded.layout.goal, atol=1e-9)
    np.testing.assert_allclose(world.people_velocities, recorded.people_velocities[-1], atol=1e-6)
    np.testing.assert_allclose(world.command, sequence.last.command, atol=1e-9)
    assert world.layout.interaction_relations == recorded.layout.interaction_relations
    assert world.layout.people_group.tolist() == [0, 0]


def test_those_who_walked_walk_on(file: Path) -> None:
    env = SocNavEnv("sparse", scenario=file)
    env.reset(seed=0)
    before, velocities = env.world.people_poses[:, :2], env.world.people_velocities[:, :2]
    for _ in range(5):
        env.step(np.zeros(2))
    np.testing.assert_allclose(env.world.people_poses[:, :2] - before, velocities, atol=0.15)


def test_what_is_seen_at_first_is_what_was_recorded_last(file: Path, feature_reward) -> None:
    env, again = SocNavEnv(feature_reward, scenario=file), SocNavEnv(feature_reward, scenario="couple_towards")
    env.reset(seed=0)
    again.reset(seed=1)
    for _ in range(12):
        again.step(np.array([0.6, 0.1]))
    for mine, theirs in zip(env.window()[:2], again.window()[:2], strict=True):  # the first snapshot has no velocities
        np.testing.assert_allclose(mine.arrays.features, theirs.arrays.features, atol=1e-5)


def test_a_recording_without_robot_poses_is_told_by_its_walls(file: Path, tmp_path: Path) -> None:
    env = SocNavEnv("sparse", scenario=changed(file, tmp_path, lambda snapshot: snapshot.pop("robot_pose")))
    env.reset(seed=0)
    world = env.world
    np.testing.assert_allclose(world.robot_pose, 0, atol=1e-9)
    reference = SocNavEnv("sparse", scenario=file)
    reference.reset(seed=0)
    np.testing.assert_allclose(world.clearance_to_people(), reference.world.clearance_to_people(), atol=1e-9)
    np.testing.assert_allclose(np.hypot(*world.robot_velocity[:2]), np.hypot(*reference.world.robot_velocity[:2]))


def test_episodes_of_recordings_replay(file: Path) -> None:
    env = SocNavEnv("sparse", scenario=file)
    env.reset(seed=0)
    for _ in range(10):
        env.step(np.array([0.5, -0.2]))
    recording = record_episode(env)
    assert first_difference(recording.trajectory, replay(recording)) is None


def test_what_cannot_be_gone_on_with_is_refused(file: Path, tmp_path: Path) -> None:
    def refused(change) -> str:
        with pytest.raises((ConfigError, ScenarioError)) as error:
            SocNavEnv("sparse", scenario=changed(file, tmp_path, change))
        assert "changed.json: " in str(error.value)
        assert "\n" not in str(error.value)
        return str(error.value)

    assert "walls must close" in refused(lambda snapshot: snapshot["walls"].pop())
    assert "farther than 0.5 m from its goal" in refused(lambda snapshot: snapshot.update(goal=[{"x": 0, "y": 0.3}]))
    assert "reach" in refused(lambda snapshot: snapshot.update(goal=[{"x": 0, "y": 99}]))
    assert "must not touch a person" in refused(lambda snapshot: snapshot["people"][0].update(x=0.0, y=0.2))
    with pytest.raises(ScenarioError, match=r"gone\.json: cannot read it"):
        SocNavEnv("sparse", scenario="gone.json")


@pytest.mark.parametrize("name", SAMPLES)
def test_genuine_recordings_go_on(name: str, shared_data: Path) -> None:
    path = shared_data / "socnav2_samples" / f"{name}.json"
    env = SocNavEnv("sparse", scenario=path)
    env.reset(seed=0)
    recorded = trajectory_of_sequence(read_socnav2(path))
    np.testing.assert_allclose(env.world.people_poses[:, :2], recorded.people_poses[-1, :, :2], atol=1e-9)
    walked = recorded.layout.people_walk
    before = env.world.people_poses
    for _ in range(10):
        env.step(np.zeros(2))
    moved = np.hypot(*(env.world.people_poses - before)[:, :2].T)
    assert moved[~walked].max(initial=0) == 0
    assert not walked.any() or np.median(moved[walked]) > 0.5
