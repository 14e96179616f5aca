import math

import numpy as np
import pytest

from socnav_env.geometry.shortest_path import edges_of, shortest_path_length
from socnav_env.layout import ObjectKind, Room
from socnav_env.scenes.rooms import l_room, rectangular_room
from tests.socnav_env.puppets import make_layout

RADIUS = 0.25


def rows_of(corners) -> np.ndarray:
    return Room(np.array(corners, dtype=float)).walls


def length(start, goal, *obstacles, radius: float = RADIUS) -> float:
    return shortest_path_length(np.array(start), np.array(goal), radius, np.vstack(obstacles))


HALL = rectangular_room(10, 10).walls
SQUARE = rows_of([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


def test_a_free_line_is_the_way() -> None:
    assert length([-2.0, 0.75], [2.0, 0.75], HALL, SQUARE) == 4.0  # the robot just grazes the square


def test_the_way_around_a_square_is_tangents_arcs_and_a_side() -> None:
    # On the height of the upper side, 1.5 m before the corner: a tangent, an arc, the side, and the same again.
    tangent, turn = math.sqrt(1.5**2 - RADIUS**2), math.asin(RADIUS / 1.5)
    assert length([-2.0, 0.5], [2.0, 0.5], HALL, SQUARE) == pytest.approx(1 + 2 * (tangent + RADIUS * turn), abs=1e-9)


def test_the_way_around_one_corner_of_an_l() -> None:
    # From (3, -4) to (-4, 3) around the corner at (1.5, -1.5): both are hypot(1.5, 2.5) and hypot(5.5, 4.5) away.
    first, second = math.hypot(1.5, 2.5), math.hypot(5.5, 4.5)
    tangents = math.sqrt(first**2 - RADIUS**2) + math.sqrt(second**2 - RADIUS**2)
    angle = 2 * math.pi - math.acos((1.5 * -5.5 + -2.5 * 4.5) / (first * second))  # on the room's side
    turn = angle - math.acos(RADIUS / first) - math.acos(RADIUS / second)
    expected = tangents + RADIUS * turn
    assert length([3.0, -4.0], [-4.0, 3.0], l_room(3).walls) == pytest.approx(expected, abs=1e-9)


def test_a_small_robot_goes_close_by_the_corners() -> None:
    expected = 2 * math.hypot(1.5, 0.5) + 1.0
    assert length([-2.0, 0.0], [2.0, 0.0], HALL, SQUARE, radius=1e-3) == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize(("gap", "way"), [(0.51, 4.0), (0.49, math.inf)])
def test_a_gap_must_be_as_wide_as_the_robot(gap: float, way: float) -> None:
    lower = rows_of([[-0.1, -5.0], [0.1, -5.0], [0.1, -gap / 2], [-0.1, -gap / 2]])
    upper = rows_of([[-0.1, gap / 2], [0.1, gap / 2], [0.1, 5.0], [-0.1, 5.0]])
    assert length([-2.0, 0.0], [2.0, 0.0], HALL, lower, upper) == way


def test_the_way_back_is_as_long() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        start, goal = rng.uniform([-4.5, -4.5], [-1.0, 4.5]), rng.uniform([1.0, -4.5], [4.5, 4.5])
        forth = length(start, goal, HALL, SQUARE)
        assert forth == pytest.approx(length(goal, start, HALL, SQUARE), abs=1e-9)
        assert forth >= math.dist(start, goal)


def test_edges_are_walls_and_the_sides_of_turned_objects_once() -> None:
    layout = make_layout(
        object_poses=np.array([[1.0, 0.0, np.pi / 2]] * 2),
        object_sizes=np.array([[0.8, 0.6]] * 2),
        object_kinds=np.array([ObjectKind.TABLE, ObjectKind.LAPTOP]),
    )
    edges = edges_of(layout)
    np.testing.assert_array_equal(edges[:4], layout.room.walls)
    assert len(edges) == 8
    # Turned by a right angle, the width of 0.8 m lies along y.
    assert {tuple(np.round(row[:2], 9).tolist()) for row in edges[4:]} == {
        (0.7, 0.4), (0.7, -0.4), (1.3, -0.4), (1.3, 0.4)
    }  # fmt: skip
    np.testing.assert_array_equal(edges[4:, :2], np.roll(edges[4:, 2:], 1, axis=0))


def test_a_layout_without_objects_has_walls_only() -> None:
    nothing = {"object_poses": np.zeros((0, 3)), "object_sizes": np.zeros((0, 2))}
    assert len(edges_of(make_layout(**nothing, object_kinds=np.zeros(0, dtype=np.int64)))) == 4
