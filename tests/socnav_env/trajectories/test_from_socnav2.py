from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from reward_model.scenes.scene import Interactions, Objects, People, ScenarioError, SceneSequence, Snapshot
from reward_model.scenes.socnav2_json import read_socnav2
from socnav_env.config import EnvConfig
from socnav_env.env import SocNavEnv
from socnav_env.metrics import episode_metrics
from socnav_env.recording.files import record_episode
from socnav_env.recording.replay import recorded_sequence
from socnav_env.trajectories.from_socnav2 import trajectory_of_sequence
from tests.socnav_env.recording.test_files import play

TALKING = "two_static_person_talking"


def snapshot(timestamp: float, robot_pose, people: dict[int, list[float]], **changes) -> Snapshot:
    """A snapshot of people by id, in the robot's frame, in a square room around the origin."""
    corners = np.array([[-3.0, 3.0], [3.0, 3.0], [3.0, -3.0], [-3.0, -3.0]])  # clockwise, as recordings have them
    cosine, sine = np.cos(robot_pose[2]), np.sin(robot_pose[2])
    local = (corners - robot_pose[:2]) @ np.array([[cosine, -sine], [sine, cosine]])
    values = {
        "timestamp": timestamp,
        "interval": 0.2,
        "command": np.array([0.3, 0.0, 0.1]),
        "goal": np.array([1.0, 0.0]),
        "people": People(
            np.array(list(people), dtype=np.int64),
            np.array(list(people.values())).reshape(-1, 3),
            np.zeros((len(people), 3)),
        ),
        "objects": Objects(np.array([7]), np.array([[0.0, 2.0, 0.0]]), np.zeros((1, 3)), np.array([[0.8, 0.6]])),
        "walls": np.hstack([local, np.roll(local, -1, axis=0)]),
        "interactions": Interactions(np.zeros((0, 2), dtype=np.int64), ()),
        "robot_pose": np.array(robot_pose),
    }
    return Snapshot(**{**values, **changes})


def test_a_scene_is_put_back_into_its_room() -> None:
    # The robot drives up the y axis and looks along it; one person walks beside it, one comes into sight later.
    talking = Interactions(np.array([[5, 2]]), (TALKING,))
    scene = SceneSequence(
        (
            snapshot(3.0, [0.0, 0.0, np.pi / 2], {2: [1.0, 0.0, 0.0]}),
            snapshot(3.1, [0.0, 0.05, np.pi / 2], {2: [1.0, 0.0, 0.0]}),
            snapshot(3.3, [0.0, 0.15, np.pi / 2], {5: [0.0, -1.0, 0.0], 2: [1.0, 0.0, 0.0]}, interactions=talking),
        )
    )
    trajectory = trajectory_of_sequence(scene, robot_radius=0.3, people_radius=0.2)
    np.testing.assert_allclose(trajectory.durations, [0.1, 0.2])
    np.testing.assert_allclose(trajectory.robot_velocities[1:], [[0.0, 0.5, 0.0]] * 2, atol=1e-9)
    np.testing.assert_allclose(trajectory.people_poses[:, 0], [[0, y, np.pi / 2] for y in (1.0, 1.05, 1.15)], atol=1e-9)
    assert np.isnan(trajectory.people_poses[:2, 1]).all()
    np.testing.assert_allclose(trajectory.people_poses[2, 1], [1.0, 0.15, np.pi / 2])
    np.testing.assert_allclose(trajectory.people_velocities[1:, 0], [[0.0, 0.5, 0.0]] * 2, atol=1e-9)
    assert np.isnan(trajectory.robot_velocities[0]).all()
    np.testing.assert_array_equal(trajectory.commands, [[0.3, 0.0, 0.1]] * 2)
    assert (trajectory.robot_radius, trajectory.people_radius, trajectory.outcome) == (0.3, 0.2, None)
    layout = trajectory.layout
    np.testing.assert_allclose(layout.goal, [0.0, 1.0], atol=1e-9)
    np.testing.assert_allclose(layout.object_poses, [[-2.0, 0.0, np.pi / 2]], atol=1e-9)
    np.testing.assert_allclose(layout.room.corners, [[-3, -3], [3, -3], [3, 3], [-3, 3]], atol=1e-9)
    assert layout.people_walk.tolist() == [True, False]
    assert (layout.interaction_pairs.tolist(), layout.interaction_relations) == ([[1, 0]], (TALKING,))


def test_a_turn_is_measured_the_short_way() -> None:
    scene = SceneSequence((snapshot(0.0, [0.0, 0.0, 3.1], {}), snapshot(0.1, [0.0, 0.0, -3.1], {})))
    assert trajectory_of_sequence(scene).robot_velocities[1, 2] == pytest.approx((2 * np.pi - 6.2) / 0.1)


def test_a_robot_without_poses_has_no_path() -> None:
    scene = SceneSequence((snapshot(0.0, [0.0, 0.0, 0.0], {1: [1.0, 0.0, 0.0]}),))
    scene = SceneSequence((replace(scene.last, robot_pose=None),), name="scene")
    with pytest.raises(ScenarioError, match=r"scene: snapshot 0: robot_pose is missing, the robot's path needs it"):
        trajectory_of_sequence(scene)


def test_walls_that_do_not_meet_make_no_room() -> None:
    scene = SceneSequence((snapshot(0.0, [0.0, 0.0, 0.0], {1: [1.0, 0.0, 0.0]}),))
    open_room = replace(scene.last, walls=scene.last.walls[:3])
    assert len(trajectory_of_sequence(SceneSequence((open_room,))).layout.room.corners) == 0


def test_an_export_of_an_episode_is_measured_like_the_episode() -> None:
    env = SocNavEnv(reward="sparse", config=EnvConfig(time_limit=6.0, warm_up=0.0))
    play(env, "joystick", seed=8)
    recording = record_episode(env)
    expected = episode_metrics(recording.trajectory)
    measured = episode_metrics(trajectory_of_sequence(recorded_sequence(recording, "scene")))
    known = [name for name, value in measured.items() if not np.isnan(value)]
    assert len(known) >= 20
    # Accelerations of the first step need the velocity before, which a scene does not tell.
    for name in set(known) - {"mean_acceleration", "max_acceleration", "mean_jerk", "max_jerk"}:
        assert measured[name] == pytest.approx(expected[name], abs=1e-6), name


def test_genuine_scenes_are_measured(shared_data: Path) -> None:
    for file in sorted((shared_data / "socnav2_samples").glob("S*.json")):
        metrics = episode_metrics(trajectory_of_sequence(read_socnav2(file)))
        unknown = {"success", "timeout", "spl", "stl", "time_to_goal", "path_length", "person_detour", "q1_mean"}
        assert all(np.isnan(metrics[name]) for name in unknown), file.name
        assert 0.0 <= metrics["mean_speed"] <= metrics["max_speed"] < 0.6, file.name
        assert metrics["min_person_distance"] > -0.5, file.name
        assert 0.0 <= metrics["social_zone"] <= 100.0, file.name
