import math

import numpy as np
import pytest

from socnav_env.geometry.distances import (
    box_distances,
    boxes_of,
    clearance,
    closest_on_box,
    first_free,
    first_free_pair,
    inside_each,
    line_is_free,
    wall_distances,
)
from socnav_env.scenes.rooms import l_room, rectangular_room

SQUARE = rectangular_room(4, 4).walls
NO_DISCS, NO_BOXES = np.empty((0, 3)), np.empty((0, 6))
TURNED_BOX = boxes_of(np.array([[1.0, 0.0, math.pi / 2]]), np.array([[1.0, 0.4]]))  # 0.4 along x, 1 along y


def test_boxes_turn_with_their_heading():
    assert box_distances(1.5, 0.0, TURNED_BOX) == pytest.approx([0.3])
    assert box_distances(1.0, 1.0, TURNED_BOX) == pytest.approx([0.5])
    assert box_distances(1.2 + 0.3, 0.5 + 0.4, TURNED_BOX) == pytest.approx([0.5])
    assert box_distances(1.0, 0.0, TURNED_BOX) == pytest.approx([-0.2])
    assert closest_on_box(3.0, 0.25, TURNED_BOX[0]) == pytest.approx((1.2, 0.25))


def test_distance_to_each_wall():
    assert wall_distances(1.0, -0.5, SQUARE) == pytest.approx([1.5, 1.0, 2.5, 3.0])
    assert wall_distances(3.0, 3.0, SQUARE) == pytest.approx([math.sqrt(26), math.sqrt(2), math.sqrt(2), math.sqrt(26)])


def test_the_corner_of_an_l_is_outside():
    points = np.array([[0.0, 0.0], [-3.0, -3.0], [3.0, -3.0], [-3.0, 3.0], [9.0, 0.0]])
    assert inside_each(points, l_room(3).walls).tolist() == [True, False, True, True, False]


def test_clearance_is_to_the_nearest_of_all():
    discs = np.array([[0.0, 1.0, 0.25]])
    assert clearance(0.0, 0.0, SQUARE, discs, TURNED_BOX) == pytest.approx(0.75)
    assert clearance(0.5, 0.0, SQUARE, NO_DISCS, TURNED_BOX) == pytest.approx(0.3)
    assert clearance(-1.5, 0.0, SQUARE, discs, TURNED_BOX) == pytest.approx(0.5)


def test_a_line_is_barred_by_what_leaves_less_room_than_asked():
    start, end = np.array([-1.0, 0.0]), np.array([1.5, 0.0])
    assert line_is_free(start, end, 0.4, SQUARE, NO_DISCS, NO_BOXES)
    assert not line_is_free(start, end, 0.4, SQUARE, np.array([[0.0, 0.6, 0.25]]), NO_BOXES)
    assert line_is_free(start, end, 0.3, SQUARE, np.array([[0.0, 0.6, 0.25]]), NO_BOXES)
    around_the_corner = np.array([-4.0, 0.0]), np.array([3.0, -4.0])
    assert not line_is_free(*around_the_corner, 0.1, l_room(3).walls, NO_DISCS, NO_BOXES)


def test_whoever_starts_too_close_may_leave_but_not_come_closer():
    beside = np.array([-1.8, 0.0])
    assert line_is_free(beside, np.array([1.0, 0.0]), 0.4, SQUARE, NO_DISCS, NO_BOXES)
    assert not line_is_free(beside, np.array([-1.9, 1.5]), 0.4, SQUARE, NO_DISCS, NO_BOXES)


def test_first_free_place_and_pair():
    places = np.array([[5.0, 0.0], [1.9, 0.0], [0.0, 0.1], [-1.0, 0.0]])
    discs = np.array([[0.0, 0.0, 0.4]])
    assert first_free(places, 0.4, SQUARE, discs, NO_BOXES) == 3
    assert first_free(places[:3], 0.4, SQUARE, discs, NO_BOXES) == -1
    firsts, seconds = np.array([[-1.0, 0.0], [-1.0, 1.0]]), np.array([[1.0, 0.0], [1.0, 1.0]])
    assert first_free_pair(firsts, seconds, 0.4, 0.4, 0.1, SQUARE, discs, NO_BOXES) == 1
    assert first_free_pair(firsts[:1], seconds[:1], 0.4, 0.4, 0.1, SQUARE, discs, NO_BOXES) == -1
