import numpy as np
import pytest

from socnav_env.metrics import METRICS, heading_change, path_irregularity
from tests.socnav_env.episodes import make_trajectory

# Speeds 1, 1, 3, 0 m/s along x, then 0.
DRIVE = [[0.0, 0.0], [0.2, 0.0], [0.4, 0.0], [1.0, 0.0], [1.0, 0.0]]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("mean_speed", (1 + 1 + 3 + 0) / 4),
        ("max_speed", 3.0),
        ("mean_acceleration", (5 + 0 + 10 + 15) / 4),  # changes by 1, 0, 2, -3 m/s in 0.2 s each
        ("max_acceleration", 15.0),
        ("mean_jerk", (25 + 50 + 125) / 3),  # from 5 to 0 to 10 to -15 m/s^2
        ("max_jerk", 125.0),
        ("heading_change", 0.0),
        ("path_irregularity", 0.0),
        ("time_not_moving", 0.2),
        ("failure_to_progress", 1.0),
    ],
)
def test_measures_of_a_drive_along_a_line(name: str, value: float) -> None:
    assert METRICS[name](make_trajectory(DRIVE)) == pytest.approx(value)


def test_a_change_of_direction_is_an_acceleration() -> None:
    corner = make_trajectory([[0.0, 0.0], [0.2, 0.0], [0.2, 0.2]])
    assert METRICS["max_acceleration"](corner) == pytest.approx(np.hypot(1.0, 1.0) / 0.2)


def test_a_velocity_that_is_not_known_makes_no_acceleration() -> None:
    velocities = np.array([[np.nan] * 3, [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    trajectory = make_trajectory(DRIVE[:4], robot_velocities=velocities)
    assert METRICS["mean_acceleration"](trajectory) == pytest.approx((5 + 0) / 2)
    assert METRICS["mean_jerk"](trajectory) == pytest.approx(25.0)
    assert METRICS["mean_speed"](trajectory) == pytest.approx(5 / 3)


def test_heading_change_adds_up_both_ways_around_the_short_way() -> None:
    headings = [3.0, -3.0, 3.0, 2.0]
    robot = np.column_stack([np.zeros((4, 2)), headings])
    assert heading_change(make_trajectory(robot)) == pytest.approx(2 * (2 * np.pi - 6) + 1.0)


def test_path_irregularity_is_the_angle_to_the_goal() -> None:
    # The goal is at (2, 0): ahead, to the right of a robot that faces y, behind, and 45 degrees to the left.
    robot = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, np.pi / 2], [0.0, 0.0, -np.pi], [1.0, -1.0, 0.0]]
    assert path_irregularity(make_trajectory(robot)) == pytest.approx((0 + 1 / 2 + 1 + 1 / 4) * np.pi / 4)


@pytest.mark.parametrize(
    ("speed", "turn_rate", "seconds"), [(0.009, -0.019, 0.2), (0.011, 0.0, 0.0), (0.0, -0.021, 0.0), (-0.011, 0.0, 0.0)]
)
def test_standing_is_neither_driving_nor_turning(speed: float, turn_rate: float, seconds: float) -> None:
    trajectory = make_trajectory([[0.0, 0.0]] * 2, robot_velocities=np.array([[0.0] * 3, [speed, 0.0, turn_rate]]))
    assert METRICS["time_not_moving"](trajectory) == pytest.approx(seconds)
