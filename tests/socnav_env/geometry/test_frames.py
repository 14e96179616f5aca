import numpy as np

from socnav_env.geometry.frames import (
    closed_lines,
    lines_between,
    points_in_frame,
    pose_rates,
    poses_in_frame,
    turned_velocities,
)
from tests.socnav_env.puppets import make_layout

FACING_UP = np.array([1.0, 2.0, np.pi / 2])


def test_a_robot_facing_up_has_the_world_right_of_it_at_its_right() -> None:
    poses = np.array([[1.0, 5.0, np.pi / 2], [3.0, 2.0, 0.0]])
    np.testing.assert_allclose(poses_in_frame(FACING_UP, poses), [[3.0, 0.0, 0.0], [0.0, -2.0, -np.pi / 2]], atol=1e-12)
    np.testing.assert_allclose(points_in_frame(FACING_UP, poses[:, :2].copy()), [[3.0, 0.0], [0.0, -2.0]], atol=1e-12)


def test_velocities_over_ground_are_turned_and_nothing_else() -> None:
    np.testing.assert_allclose(
        turned_velocities(np.pi / 2, np.array([[1.0, 0.0, 0.5]])), [[0.0, -1.0, 0.5]], atol=1e-12
    )


def test_rates_turn_the_short_way_across_half_a_turn() -> None:
    earlier, later = np.array([[0.0, 0.0, 3.1]]), np.array([[0.1, -0.2, -3.1]])
    np.testing.assert_allclose(pose_rates(earlier, later, 0.2), [[0.5, -1.0, (2 * np.pi - 6.2) / 0.2]])


def test_nobody_has_no_frame() -> None:
    assert poses_in_frame(FACING_UP, np.zeros((0, 3))).shape == (0, 3)


def test_closed_lines_return_to_the_first_corner() -> None:
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]])
    np.testing.assert_array_equal(closed_lines(corners), [[0, 0, 2, 0], [2, 0, 0, 1], [0, 1, 0, 0]])


def test_lines_join_people_where_they_are_now_with_objects() -> None:
    people = np.array([[0.5, 0.6, 0.0], [0.7, 0.8, 0.0]])
    objects = make_layout().object_poses
    lines = lines_between(np.array([[0, 1], [1, 3]]), people, objects)
    np.testing.assert_array_equal(lines, [[0.5, 0.6, 0.7, 0.8], [0.7, 0.8, -2.0, 0.0]])
    assert lines_between(np.zeros((0, 2), dtype=np.int64), people, objects).shape == (0, 4)
