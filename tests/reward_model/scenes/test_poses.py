from math import pi

import numpy as np
import pytest

from reward_model.scenes.poses import aligned, driven, placed_at, rotated, seen_from


def test_a_quarter_turn():
    np.testing.assert_allclose(rotated(np.array([[1.0, 0.0], [0.0, 2.0]]), pi / 2), [[0, 1], [-2, 0]], atol=1e-12)


def test_what_stands_to_the_left_of_a_viewpoint():
    viewpoint = np.array([1.0, 2.0, pi / 2])  # looks along y; its left is -x
    poses = np.array([[0.0, 5.0, pi]])
    np.testing.assert_allclose(seen_from(viewpoint, poses), [[3.0, 1.0, pi / 2]], atol=1e-12)
    np.testing.assert_allclose(placed_at(viewpoint, seen_from(viewpoint, poses)), poses, atol=1e-12)


@pytest.mark.parametrize(
    ("command", "duration", "expected"),
    [
        ((0.5, 0.0), 2.0, (1.0, 0.0, 0.0)),
        ((0.5, 0.0), -2.0, (-1.0, 0.0, 0.0)),
        ((0.0, 0.25), 2.0, (0.0, 0.0, 0.5)),
        ((pi / 2, pi / 2), 1.0, (1.0, 1.0, pi / 2)),  # a quarter of a circle of 1 m radius, to the left
        ((pi / 2, pi / 2), -1.0, (-1.0, 1.0, -pi / 2)),  # and where a quarter circle to here came from
    ],
)
def test_driving(command, duration, expected):
    np.testing.assert_allclose(driven(*command, duration), expected, atol=1e-12)


def test_a_viewpoint_is_found_again_from_what_it_sees():
    points = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]])
    viewpoint = np.array([1.0, -2.0, 0.5])
    as_poses = np.column_stack([points, np.zeros(3)])
    np.testing.assert_allclose(aligned(seen_from(viewpoint, as_poses)[:, :2], points), viewpoint, atol=1e-12)
