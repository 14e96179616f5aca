import math

import numpy as np
import pytest

from socnav_env.config import GroupConfig, PeopleConfig
from socnav_env.people.groups import group_force
from socnav_env.people.social_force import walk
from socnav_env.people.walkers import Surroundings, Walkers, habits_of
from socnav_env.scenes.circles import circle_poses, circle_radius
from socnav_env.scenes.rooms import rectangular_room

STEP = 0.05  # s
HALL = Surroundings(rectangular_room(60, 60).walls, np.empty((0, 3)), np.empty((0, 6)))
PAIR = np.array([0, 0])


def bodies_of(*rows):
    return np.array([*rows, [0.0, 29.0, 0.0, 0.0, 0.0, 0.0]])


def test_who_has_to_look_back_slows_down():
    habits = habits_of(PeopleConfig(group=GroupConfig(gaze=4.0)))
    bodies = bodies_of([1.0, 0.0, 0.0, 0.8, 0.0, 0.0], [0.0, 0.0, 0.0, 0.8, 0.0, 0.0])
    # The head turns by pi, of which pi / 2 are free: 4 * pi / 2 * 0.8 against the way walked.
    assert group_force(0, bodies, PAIR, 0.6, habits) == pytest.approx((-4 * math.pi / 2 * 0.8, 0.0))
    assert group_force(1, bodies, PAIR, 0.6, habits) == pytest.approx((0.0, 0.0))


def test_who_is_far_from_the_middle_is_drawn_to_it():
    habits = habits_of(PeopleConfig(group=GroupConfig(cohesion=3.0)))
    near = bodies_of([0.0, 0.9, 0.0, 0.8, 0.0, 0.0], [0.0, 0.0, 0.0, 0.8, 0.0, 0.0])
    far = bodies_of([0.0, 1.1, 0.0, 0.8, 0.0, 0.0], [0.0, 0.0, 0.0, 0.8, 0.0, 0.0])
    assert group_force(0, near, PAIR, 0.6, habits) == pytest.approx((0.0, 0.0))
    assert group_force(0, far, PAIR, 0.6, habits) == pytest.approx((0.0, -3.0))


def test_companions_closer_than_their_spacing_make_room():
    habits = habits_of(PeopleConfig(group=GroupConfig(repulsion=1.0)))
    bodies = bodies_of([0.0, 0.5, 0.0, 0.8, 0.0, 0.0], [0.0, 0.0, 0.0, 0.8, 0.0, 0.0])
    assert group_force(0, bodies, PAIR, 0.6, habits) == pytest.approx((0.0, 1.0))
    assert group_force(0, bodies, PAIR, 0.4, habits) == pytest.approx((0.0, 0.0))
    assert group_force(0, bodies, np.array([0, 1]), 0.6, habits) == pytest.approx((0.0, 0.0))


@pytest.mark.parametrize(
    "forces", [GroupConfig(), GroupConfig(formation=0.0, gaze=4.0, cohesion=3.0, repulsion=1.0)], ids=["places", "2010"]
)
def test_three_who_begin_apart_end_as_a_group_under_way(forces):
    people = PeopleConfig(group=forces)
    walkers = Walkers(
        speed=np.full(3, 0.75), group=np.zeros(3, dtype=np.int64), spacing=np.full(3, 0.6),
        target=np.full((3, 2), (25.0, 0.0)), time_left=np.full(3, 99.0), blocked=np.zeros(3), facing=np.full(3, np.nan),
    )  # fmt: skip
    bodies = bodies_of(*([x, y, 0.0, 0.0, 0.0, 0.0] for x, y in [(-20.0, 0.0), (-22.0, 1.5), (-20.5, -2.0)]))
    velocities, habits = np.zeros((4, 3)), habits_of(people)
    for _ in range(600):
        walk(STEP, bodies, walkers, 0.0, 1.0, HALL, habits, velocities)
        bodies[:, 3:] = velocities
        bodies[:, :3] += STEP * velocities
    places = bodies[:3, :2]
    apart = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))[np.triu_indices(3, 1)]
    assert places[:, 0].min() > -5.0
    assert apart.min() > 0.3
    assert apart.max() < 2.3


def test_a_circle_has_neighbours_as_far_apart_as_asked():
    poses = circle_poses(np.array([1.0, 2.0]), circle_radius(4, 1.2), 4, 0.0)
    half = 0.6 * math.sqrt(2)
    assert poses[:, :2] == pytest.approx(np.array([[1 + half, 2], [1, 2 + half], [1 - half, 2], [1, 2 - half]]))
    assert poses[:, 2] == pytest.approx([-math.pi, -math.pi / 2, 0.0, math.pi / 2])
