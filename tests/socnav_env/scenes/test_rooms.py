import numpy as np
import pytest

from socnav_env.config import RoomConfig
from socnav_env.geometry.distances import boxes_of
from socnav_env.scenes.rooms import is_reachable, l_room, rectangular_room, sample_room

NO_DISCS, NO_BOXES = np.empty((0, 3)), np.empty((0, 6))


def signed_area(corners):
    x, y = corners.T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2)


def test_an_l_is_a_square_of_three_units_without_two_by_one():
    room = l_room(3)
    assert signed_area(room.corners) == pytest.approx(81 - 18)
    assert room.corners.tolist() == [[1.5, -4.5], [4.5, -4.5], [4.5, 4.5], [-4.5, 4.5], [-4.5, -1.5], [1.5, -1.5]]
    lengths = np.hypot(*(room.walls[:, 2:] - room.walls[:, :2]).T)
    assert lengths.tolist() == [3, 9, 9, 6, 6, 3]


def test_walls_close_the_room():
    room = rectangular_room(6, 4)
    assert room.walls.tolist() == [[-3, -2, 3, -2], [3, -2, 3, 2], [3, 2, -3, 2], [-3, 2, -3, -2]]


def test_rooms_are_a_third_each_with_whole_sides_in_range():
    rng = np.random.default_rng(1)
    rooms = [sample_room(RoomConfig(), rng) for _ in range(3000)]
    sides = [tuple(np.ptp(room.corners, axis=0).astype(int)) for room in rooms]
    l_shapes = sum(len(room.corners) == 6 for room in rooms)
    assert abs(l_shapes - 1000) < 100
    assert {side for room, side in zip(rooms, sides, strict=True) if len(room.corners) == 6} == {(9, 9), (12, 12)}
    four_walled = [side for room, side in zip(rooms, sides, strict=True) if len(room.corners) == 4]
    assert all(5 <= breadth <= length <= 10 for length, breadth in four_walled)
    assert {length for length, _ in four_walled} == {5, 6, 7, 8, 9, 10}
    assert all(signed_area(room.corners) > 0 for room in rooms)


def test_only_the_kinds_asked_for():
    rng = np.random.default_rng(0)
    config = RoomConfig(kinds=("square",), square_side=(7, 7))
    assert all(np.ptp(sample_room(config, rng).corners, axis=0).tolist() == [7, 7] for _ in range(20))


@pytest.mark.parametrize(("gap", "expected"), [(0.45, False), (0.8, True)])
def test_a_goal_behind_a_gap_is_reached_where_the_robot_fits(gap, expected):
    walls = rectangular_room(6, 6).walls
    length = 3 - gap / 2
    middles = np.array([[0.0, -(gap / 2 + length / 2), 0.0], [0.0, gap / 2 + length / 2, 0.0]])
    barrier = boxes_of(middles, np.full((2, 2), (0.2, length)))
    start, goal = np.array([-2.0, 1.0]), np.array([2.0, -1.0])
    assert is_reachable(start, goal, 0.5, 0.25, walls, NO_DISCS, barrier) is expected


def test_a_goal_around_the_corner_is_reached_and_one_ringed_by_people_is_not():
    walls = l_room(3).walls
    start, goal = np.array([-4.0, 0.0]), np.array([3.0, -4.0])
    assert is_reachable(start, goal, 0.5, 0.25, walls, NO_DISCS, NO_BOXES)
    angles = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    ring = np.column_stack([3.0 + 0.9 * np.cos(angles), -3.0 + 0.9 * np.sin(angles), np.full(8, 0.25)])
    assert not is_reachable(start, np.array([3.0, -3.0]), 0.3, 0.25, walls, ring, NO_BOXES)


def test_turned_rooms_stand_at_any_angle_with_their_walls_as_long_as_before():
    rng = np.random.default_rng(0)
    rooms = [sample_room(RoomConfig(kinds=("square",), square_side=(7, 7), turned=True), rng) for _ in range(200)]
    walls = np.array([room.walls for room in rooms])
    sides = walls[:, :, 2:] - walls[:, :, :2]
    assert np.hypot(sides[..., 0], sides[..., 1]) == pytest.approx(np.full((200, 4), 7))
    assert all(signed_area(room.corners) == pytest.approx(49) for room in rooms)
    counts, _ = np.histogram(np.arctan2(sides[:, 0, 1], sides[:, 0, 0]), bins=4, range=(-np.pi, np.pi))
    assert counts.min() > 30
