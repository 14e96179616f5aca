import numpy as np
import pytest

from reward_model.scenes.scene import Scores
from socnav_env.config import EnvConfig
from socnav_env.trajectories.outcomes import Outcome
from socnav_env.trajectories.trajectory import TrajectoryRecorder
from tests.socnav_env.puppets import PuppetWorld


def test_a_recording_has_a_row_for_the_start_and_one_a_step() -> None:
    world = PuppetWorld()
    world.people_velocities[0] = [0.0, -0.5, 0.0]
    recorder = TrajectoryRecorder(world, EnvConfig(time_limit=1.0))
    for scores in (Scores(0.9, 0.8), None, Scores(0.7, 0.6)):
        world.advance(np.array([0.3, 0.0, 0.0]))
        recorder.record(scores)
    trajectory = recorder.trajectory(Outcome.TIMEOUT)
    assert len(trajectory) == 3
    assert trajectory.outcome is Outcome.TIMEOUT
    assert (trajectory.robot_radius, trajectory.people_radius) == (0.25, 0.25)
    assert trajectory.top_speed == pytest.approx(0.372, abs=1e-3)
    np.testing.assert_allclose(trajectory.times, [0.0, 0.2, 0.4, 0.6])
    np.testing.assert_allclose(trajectory.durations, [0.2, 0.2, 0.2])
    np.testing.assert_array_equal(trajectory.commands, [[0.3, 0.0, 0.0]] * 3)
    np.testing.assert_array_equal(trajectory.people_targets[3], [[1.0, 2.0], [1.0, -1.0]])
    np.testing.assert_allclose(trajectory.robot_poses[:, 0], [0.0, 0.06, 0.12, 0.18])
    np.testing.assert_allclose(trajectory.robot_velocities[:, 0], [0.0, 0.3, 0.3, 0.3])
    np.testing.assert_allclose(trajectory.people_poses[:, 0, 1], [2.0, 1.9, 1.8, 1.7])
    np.testing.assert_array_equal(trajectory.people_velocities[3], [[0.0, -0.5, 0.0], [0.0, 0.0, 0.0]])
    np.testing.assert_array_equal(trajectory.scores, [[0.9, 0.8], [np.nan, np.nan], [0.7, 0.6]])


def test_a_trajectory_is_not_changed_by_what_comes_later() -> None:
    world = PuppetWorld()
    recorder = TrajectoryRecorder(world, EnvConfig(time_limit=1.0))
    recorder.record(None)
    trajectory = recorder.trajectory(None)
    recorder.record(Scores(0.5, 0.5))
    assert len(trajectory) == 1
    assert not np.shares_memory(trajectory.scores, recorder.trajectory(None).scores)
