import math

import numpy as np
import pytest

from socnav_env.geometry.distances import boxes_of
from socnav_env.geometry.rays import in_view, ray_distances, ray_to_box, ray_to_disc, ray_to_wall

NO_WALLS, NO_DISCS, NO_BOXES = np.zeros((0, 4)), np.zeros((0, 3)), np.zeros((0, 6))
EAST, NORTH = (1.0, 0.0), (0.0, 1.0)


@pytest.mark.parametrize(
    ("wall", "direction", "distance"),
    [
        ((2, -1, 2, 1), EAST, 2.0),
        ((2, 1, 2, -1), EAST, 2.0),
        ((2, 0, 2, 1), EAST, 2.0),  # at its end
        ((2, 0.1, 2, 1), EAST, np.inf),
        ((-2, -1, -2, 1), EAST, np.inf),  # behind
        ((1, 0, 3, 0), EAST, np.inf),  # along the ray
        ((-1, 1, 3, 5), NORTH, 2.0),
    ],
)
def test_walls(wall: tuple, direction: tuple, distance: float) -> None:
    assert ray_to_wall(0.0, 0.0, *direction, np.array([wall], dtype=np.float64), 0) == pytest.approx(distance)


@pytest.mark.parametrize(
    ("disc", "distance"),
    [
        ((3, 0, 0.5), 2.5),
        ((3, 0.3, 0.5), 3 - 0.4),
        ((3, 0.6, 0.5), np.inf),
        ((-3, 0, 0.5), np.inf),
        ((0.2, 0, 0.5), 0.0),
    ],
)
def test_discs(disc: tuple, distance: float) -> None:
    assert ray_to_disc(0.0, 0.0, *EAST, np.array([disc], dtype=np.float64), 0) == pytest.approx(distance)


@pytest.mark.parametrize(
    ("pose", "distance"),
    [
        ((3, 0, 0), 2.0),
        ((3, 0, math.pi / 2), 2.6),
        ((3, 0.39, 0), 2.0),
        ((3, 0.41, 0), np.inf),
        ((-3, 0, 0), np.inf),
        ((0.5, 0, 0), 0.0),
        ((3, 0, math.atan2(0.4, 1.0)), 3 - 0.4 / math.sin(math.atan2(0.4, 1.0))),
    ],
)
def test_boxes(pose: tuple, distance: float) -> None:
    boxes = boxes_of(np.array([pose], dtype=np.float64), np.array([[2.0, 0.8]]))
    assert ray_to_box(0.0, 0.0, *EAST, boxes, 0) == pytest.approx(distance)


def test_the_first_thing_in_each_direction_counts() -> None:
    walls = np.array([[5.0, -9.0, 5.0, 9.0]])
    discs = np.array([[3.0, 0.0, 0.5], [0.0, 2.0, 0.5]])
    boxes = boxes_of(np.array([[1.0, 0.0, 0.0]]), np.array([[0.2, 0.2]]))
    headings = np.array([0.0, math.pi / 4, math.pi / 2, math.pi])
    distances = ray_distances(0.0, 0.0, headings, 8.0, walls, discs, boxes)
    assert distances == pytest.approx([0.9, 5 * math.sqrt(2), 1.5, 8.0])


def seen(places: list, walls=NO_WALLS, discs=NO_DISCS, boxes=NO_BOXES, **limits) -> list[bool]:
    """From the origin, looking to the east."""
    limits = {"field_of_view": 2 * math.pi, "longest": np.inf, "occlusion": True, **limits}
    pose, places = np.zeros(3), np.array(places, dtype=np.float64).reshape(-1, 2)
    return in_view(pose, places, *limits.values(), walls, discs, boxes).tolist()


def test_who_is_too_far_or_too_far_to_the_side_is_not_seen() -> None:
    places = [(2, 0), (0, 2), (-2, 0), (1.9, 2)]
    assert seen(places, occlusion=False) == [True] * 4
    assert seen(places, occlusion=False, longest=2.5) == [True, True, True, False]
    assert seen(places, occlusion=False, field_of_view=math.pi) == [True, True, False, True]
    assert seen(places, occlusion=False, field_of_view=math.pi / 2) == [True, False, False, False]


def test_walls_people_and_objects_hide_what_is_behind_them() -> None:
    places = [(2, 0), (4, 0), (0, 3)]
    discs = np.array([[x, y, 0.25] for x, y in places], dtype=np.float64)
    assert seen(places, discs=discs) == [True, False, True]
    assert seen(places, discs=discs, occlusion=False) == [True, True, True]
    walls = np.array([[-1.0, 2.0, 1.0, 2.0]])
    assert seen(places, discs=discs, walls=walls) == [True, False, False]
    box = boxes_of(np.array([[1.0, 0.0, 0.3]]), np.array([[0.4, 0.4]]))
    assert seen([*places, (1, 0)], discs=discs, boxes=box) == [False, False, True, True]


def test_a_laptop_is_not_hidden_by_its_table() -> None:
    poses = np.array([[2.0, 0.0, 0.3], [2.0, 0.0, 0.3], [4.0, 0.0, 0.0]])
    boxes = boxes_of(poses, np.array([[0.9, 0.8], [0.79, 0.78], [0.2, 0.3]]))
    assert seen(poses[:, :2], boxes=boxes) == [True, True, False]
