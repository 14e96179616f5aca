"""What holds for all measures."""

import numpy as np

from socnav_env.metrics import METRICS, episode_metrics
from tests.conftest import PROJECT
from tests.socnav_env.episodes import make_trajectory

ROBOT = [[0.0, 0.0], [0.3, 0.0], [0.7, 0.0], [0.7, 0.0], [0.6, 0.0]]


def test_every_measure_has_a_unit_or_range_and_a_source() -> None:
    for name, metric in METRICS.items():
        assert metric.__name__ == name
        assert metric.__doc__
        assert "(" in metric.__doc__, f"{name} names no source"


def test_an_episode_without_steps_is_measured_without_complaint() -> None:
    metrics = episode_metrics(make_trajectory([[0.0, 0.0]], people=[[1.0, 0.0]], outcome=None))
    assert set(metrics) == set(METRICS)
    assert metrics["failure_to_progress"] == metrics["time_not_moving"] == metrics["interaction_crossings"] == 0.0
    assert np.isnan(metrics["mean_speed"])


def test_measuring_leaves_the_recording_as_it_is() -> None:
    trajectory, untouched = (make_trajectory(ROBOT, people=[[1.5, 0.0]]) for _ in range(2))
    episode_metrics(trajectory)
    for name in ("times", "robot_poses", "robot_velocities", "people_poses", "people_velocities", "scores"):
        np.testing.assert_array_equal(getattr(trajectory, name), getattr(untouched, name))


def test_turning_the_room_changes_nothing() -> None:
    robot = np.array(ROBOT)
    people = np.array([[1.0, 0.4], [-0.5, 1.0]]) + np.arange(5)[:, None, None] * [0.1, 0.02]
    one = make_trajectory(np.column_stack([robot, np.zeros(5)]), people=people)
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])  # by a right angle, which leaves a square room in place
    other = make_trajectory(np.column_stack([robot @ turn, np.full(5, np.pi / 2)]), people=people @ turn)
    object.__setattr__(other.layout, "goal", one.layout.goal @ turn)
    object.__setattr__(other.layout, "object_poses", np.array([[0.0, -2.0, np.pi / 2]] * 2))
    expected = episode_metrics(one)
    for name, value in episode_metrics(other).items():
        np.testing.assert_allclose(value, expected[name], atol=1e-9, err_msg=name)


def test_every_measure_is_documented() -> None:
    table = (PROJECT / "docs" / "metrics.md").read_text(encoding="utf-8")
    assert [name for name in METRICS if f"`{name}`" not in table] == []
