import math

import numpy as np
import pytest

from socnav_env.metrics import (
    METRICS,
    discomfort_distance,
    discomfort_rate,
    intrusion_distance,
    intrusion_ratio,
    mean_min_person_distance,
    min_person_distance,
    min_time_to_collision,
)
from tests.socnav_env.episodes import make_trajectory

ROBOT = [[0.0, 0.0], [0.3, 0.0], [0.7, 0.0], [0.7, 0.0], [0.6, 0.0]]
ZONES = ("intimate_zone", "personal_zone", "social_zone")


def test_distances_are_between_surfaces_and_to_the_closest_person() -> None:
    # Centre distances after each step: 1.2, 0.8, 0.8, 0.9.
    trajectory = make_trajectory(ROBOT, people=[[1.5, 0.0], [9.0, 0.0]])
    assert min_person_distance(trajectory) == pytest.approx(0.3)
    assert mean_min_person_distance(trajectory) == pytest.approx((0.7 + 0.3 + 0.3 + 0.4) / 4)


@pytest.mark.parametrize(
    ("person_x", "zones", "rate", "distance"),
    [
        (1.1, (50.0, 100.0, 100.0), 0.75, (-0.1 - 0.1 + 0.0) / 3),  # centres 0.8, 0.4, 0.4, 0.5
        (1.7, (0.0, 75.0, 100.0), 0.0, np.nan),  # 1.4, 1.0, 1.0, 1.1
        (4.1, (0.0, 0.0, 75.0), 0.0, np.nan),  # 3.8, 3.4, 3.4, 3.5
    ],
)
def test_zones_are_centre_distances_and_discomfort_is_between_surfaces(
    person_x: float, zones: tuple[float, ...], rate: float, distance: float
) -> None:
    trajectory = make_trajectory(ROBOT, people=[[person_x, 0.0]])
    assert [METRICS[name](trajectory) for name in ZONES] == pytest.approx(zones)
    assert discomfort_rate(trajectory) == rate
    assert discomfort_distance(trajectory) == pytest.approx(distance, nan_ok=True)


def test_zones_are_shares_of_the_time_and_not_of_the_steps() -> None:
    trajectory = make_trajectory(ROBOT, people=[[1.7, 0.0]], times=np.array([0.0, 0.7, 0.8, 0.9, 1.0]))
    assert METRICS["personal_zone"](trajectory) == pytest.approx(30.0)


def test_nobody_is_at_no_distance_in_no_zone_and_on_no_course() -> None:
    trajectory = make_trajectory(ROBOT)
    unknown = ("min_person_distance", "mean_min_person_distance", "discomfort_distance", "intrusion_distance")
    assert all(np.isnan(METRICS[name](trajectory)) for name in (*unknown, "min_time_to_collision"))
    assert all(METRICS[name](trajectory) == 0.0 for name in (*ZONES, "discomfort_rate", "intrusion_ratio"))


def test_a_person_out_of_sight_counts_for_nothing() -> None:
    people = np.full((5, 2, 2), [[1.5, 0.0], [np.nan, np.nan]])
    both, one = make_trajectory(ROBOT, people=people), make_trajectory(ROBOT, people=[[1.5, 0.0]])
    for name in ("min_person_distance", "personal_zone", "intrusion_ratio", "min_time_to_collision"):
        assert METRICS[name](both) == METRICS[name](one)


def test_the_robot_intrudes_where_a_person_will_be_within_a_second() -> None:
    # One person walks along y = 0 at 1 m/s from x = 0. The robot's centre is 0.4 m beside that line, ahead of them,
    # then beyond their next second, then behind them, then too far to the side.
    people = np.array([[[-0.2, 0.0]], [[0.0, 0.0]], [[0.2, 0.0]], [[0.4, 0.0]], [[0.6, 0.0]]])
    robot = [[0.0, 0.4], [0.8, 0.4], [1.6, 0.4], [-0.2, 0.4], [0.8, 0.6]]
    trajectory = make_trajectory(robot, people=people)
    assert intrusion_ratio(trajectory) == 0.25
    assert intrusion_distance(trajectory) == pytest.approx(math.hypot(0.8, 0.4) - 0.5)


def test_the_far_end_of_a_way_is_round() -> None:
    people = np.array([[[-0.2, 0.0]], [[0.0, 0.0]]])  # at 1 m/s: until (1, 0)
    for robot, ratio in (([1.49, 0.0], 1.0), ([1.51, 0.0], 0.0), ([1.3, 0.41], 0.0), ([1.3, 0.39], 1.0)):
        assert intrusion_ratio(make_trajectory([[5.0, 5.0], robot], people=people)) == ratio


def test_time_to_collision_is_the_shortest_on_straight_lines() -> None:
    # At 0.5 m/s towards someone who stands: surfaces are 2.4, 2.3, 2.2 m apart after the steps.
    robot = [[0.0, 0.0], [0.1, 0.0], [0.2, 0.0], [0.3, 0.0]]
    trajectory = make_trajectory(robot, people=[[3.0, 0.0], [-3.0, 0.0]])
    assert min_time_to_collision(trajectory) == pytest.approx(2.2 / 0.5)


def test_time_to_collision_knows_how_bodies_pass() -> None:
    robot = [[0.0, 0.0], [0.1, 0.0]]  # 0.5 m/s along x
    assert np.isnan(min_time_to_collision(make_trajectory(robot, people=[[2.1, 0.51]])))
    # Centres touch at 0.5 m: 0.3 m beside the line, so 0.4 m before the person.
    assert min_time_to_collision(make_trajectory(robot, people=[[2.1, 0.3]])) == pytest.approx((2.0 - 0.4) / 0.5)
    # Coming at the robot at 1.5 m/s.
    coming = np.array([[[4.4, 0.0]], [[4.1, 0.0]]])
    assert min_time_to_collision(make_trajectory(robot, people=coming)) == pytest.approx((4.0 - 0.5) / 2.0)
    # Walking ahead, as fast as the robot: never.
    ahead = np.array([[[2.0, 0.0]], [[2.1, 0.0]]])
    assert np.isnan(min_time_to_collision(make_trajectory(robot, people=ahead)))


def test_bodies_that_touch_have_no_time_left() -> None:
    assert min_time_to_collision(make_trajectory(ROBOT, people=[[1.0, 0.0]])) == 0.0
