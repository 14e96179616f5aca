import math

import numpy as np
import pytest

from socnav_env.config import PeopleConfig
from socnav_env.people.social_force import first_in_sight, walk
from socnav_env.people.walkers import Surroundings, Walkers, habits_of, in_need_of_target, sample_speeds, walkers_of
from socnav_env.scenes.rooms import l_room, rectangular_room

STEP = 0.05  # s
HABITS = habits_of(PeopleConfig())
HALL = Surroundings(rectangular_room(40, 40).walls, np.empty((0, 3)), np.empty((0, 6)))
FAR_ROBOT = [0.0, 19.0, 0.0]


def walkers_to(targets, groups=None, speed=0.6, spacing=0.0):
    count = len(targets)
    return Walkers(
        speed=np.full(count, speed),
        group=np.arange(count) if groups is None else np.array(groups),
        spacing=np.full(count, spacing),
        target=np.array(targets, dtype=np.float64),
        time_left=np.full(count, 12.0),
        blocked=np.zeros(count),
        facing=np.full(count, np.nan),
    )


def simulate(poses, walkers, seconds, robot=FAR_ROBOT, stop_distance=1.2, notice=1.0, around=HALL, habits=HABITS):
    """Follow the velocities that `walk` finds, without contacts. Returns (steps, num_walkers, 6)."""
    bodies = np.zeros((len(poses) + 1, 6))
    bodies[:-1, :3], bodies[-1, :3] = poses, robot
    velocities, history = np.zeros((len(bodies), 3)), []
    for _ in range(round(seconds / STEP)):
        walk(STEP, bodies, walkers, stop_distance, notice, around, habits, velocities)
        bodies[:, 3:] = velocities
        bodies[:, :3] += STEP * velocities
        history.append(bodies[:-1].copy())
    return np.array(history)


def test_a_walker_alone_goes_straight_at_the_desired_speed_and_stops_at_the_target():
    path = simulate([[0.0, 0.0, 0.0]], walkers_to([[5.0, 0.0]]), 14.0)
    assert path[80, 0, 3] == pytest.approx(0.6, abs=0.01)
    assert np.abs(path[:, 0, 1]).max() < 0.01
    assert math.dist(path[-1, 0, :2], (5.0, 0.0)) < 0.2
    assert path[-1, 0, 3:].tolist() == [0.0, 0.0, 0.0]


def test_the_relaxation_time_says_how_fast_a_walker_starts():
    walkers = walkers_to([[9.0, 0.0]])
    path = simulate([[0.0, 0.0, 0.0]], walkers, 0.05)
    assert path[0, 0, 3] == pytest.approx(0.6 * 0.05 / 0.5)
    assert walkers.time_left.tolist() == pytest.approx([11.95])


def test_a_walker_turns_no_faster_than_people_do_and_does_not_walk_backwards():
    path = simulate([[0.0, 0.0, math.pi * 0.9]], walkers_to([[5.0, 0.0]]), 8.0)
    assert np.abs(path[:, 0, 5]).max() <= 1.5
    assert abs(math.remainder(path[-1, 0, 2], 2 * math.pi)) < 0.05
    ahead = np.cos(path[:, 0, 2]) * path[:, 0, 3] + np.sin(path[:, 0, 2]) * path[:, 0, 4]
    assert ahead.min() >= -0.01


def test_two_who_meet_step_aside_to_the_same_hand():
    path = simulate([[-3.0, 0.0, 0.0], [3.0, 0.0, math.pi]], walkers_to([[4.0, 0.0], [-4.0, 0.0]]), 20.0)
    apart = np.hypot(*(path[:, 0, :2] - path[:, 1, :2]).T)
    assert apart.min() > 0.5
    closest = path[apart.argmin()]
    assert closest[0, 1] * closest[1, 1] < 0
    assert math.dist(path[-1, 0, :2], (4.0, 0.0)) < 0.3
    assert math.dist(path[-1, 1, :2], (-4.0, 0.0)) < 0.3


def test_a_walker_goes_around_someone_who_stands():
    around = HALL._replace(discs=np.array([[0.0, 0.05, 0.25]]))
    path = simulate([[-3.0, 0.0, 0.0]], walkers_to([[3.0, 0.0]]), 20.0, around=around)
    assert np.hypot(path[:, 0, 0], path[:, 0, 1] - 0.05).min() > 0.5
    assert math.dist(path[-1, 0, :2], (3.0, 0.0)) < 0.3


def test_a_walker_stops_for_a_robot_it_notices():
    path = simulate([[-3.0, 0.0, 0.0]], walkers_to([[3.0, 0.0]]), 15.0, robot=[0.0, 0.0, 0.0])
    assert 0.8 < abs(path[-1, 0, 0]) < 1.2
    assert path[-1, 0, 3:].tolist() == [0.0, 0.0, 0.0]


def test_an_invisible_robot_is_walked_through():
    invisible = {"robot": [0.0, 0.0, 0.0], "stop_distance": 0.0, "notice": 0.0}
    path = simulate([[-3.0, 0.0, 0.0]], walkers_to([[3.0, 0.0]]), 15.0, **invisible)
    assert np.abs(path[:, 0, 1]).max() < 0.01
    assert math.dist(path[-1, 0, :2], (3.0, 0.0)) < 0.2


def test_a_couple_stays_side_by_side_and_stops_together():
    poses = [[-4.0, 0.3, 0.0], [-4.0, -0.3, 0.0]]
    path = simulate(poses, walkers_to([[5.0, 0.0]] * 2, groups=[0, 0], spacing=0.6), 10.0)
    gap = path[:, 0, :2] - path[:, 1, :2]
    assert np.hypot(*gap.T) == pytest.approx(np.full(len(gap), 0.6), abs=0.05)
    path = simulate(poses, walkers_to([[5.0, 0.0]] * 2, groups=[0, 0], spacing=0.6), 3.0, robot=[-4.0, 1.4, 0.0])
    assert path[-1, :, 0].tolist() == [-4.0, -4.0]


def test_a_couple_that_turns_back_walks_abreast_again():
    poses = [[0.0, 0.3, math.pi / 2], [0.0, -0.3, math.pi / 2]]
    path = simulate(poses, walkers_to([[0.0, 9.0]] * 2, groups=[0, 0], spacing=0.6), 12.0)
    assert abs(path[-1, 0, 1] - path[-1, 1, 1]) < 0.1
    assert abs(path[-1, 0, 0] - path[-1, 1, 0]) == pytest.approx(0.6, abs=0.1)


def test_a_walker_who_cannot_get_on_counts_as_blocked():
    walkers = walkers_to([[3.0, 0.0]])
    bodies = np.zeros((2, 6))
    bodies[-1, :3] = FAR_ROBOT
    velocities = np.zeros((2, 3))
    for _ in range(30):
        walk(STEP, bodies, walkers, 1.2, 1.0, HALL, HABITS, velocities)  # the body is held where it is
    assert walkers.blocked.tolist() == pytest.approx([1.5])
    assert in_need_of_target(walkers, 2.0).tolist() == [False]
    assert in_need_of_target(walkers, 1.4).tolist() == [True]


def test_targets_around_the_corner_are_not_in_sight():
    walls = l_room(3).walls
    start = np.array([-4.0, 0.0])
    places = np.array([[3.0, -4.0], [-3.0, -3.0], [4.4, 0.0], [3.0, 1.0]])
    assert first_in_sight(start, places, 0.4, walls, np.empty((0, 3)), np.empty((0, 6))) == 3
    assert first_in_sight(start, places[:3], 0.4, walls, np.empty((0, 3)), np.empty((0, 6))) == -1


def test_desired_speeds_stay_within_their_limits():
    speeds = sample_speeds(PeopleConfig(speed_deviation=1.0), 500, np.random.default_rng(0))
    assert speeds.min() == 0.4
    assert speeds.max() == 1.0


def test_those_who_walk_together_share_the_slowest_speed_and_keep_their_distance():
    poses = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 0.6, 0.0], [0.0, 1.2, 0.0]])
    walkers = walkers_of(poses, np.array([0, -1, 0, 0]), PeopleConfig(), np.random.default_rng(0))
    assert walkers.group.tolist() == [0, 1, 0, 0]
    assert walkers.spacing.tolist() == pytest.approx([0.6, 0.0, 0.6, 0.6])
    assert walkers.speed[0] == walkers.speed[2] == walkers.speed[3]
    assert walkers.speed[1] != walkers.speed[0]
    assert in_need_of_target(walkers, 2.0).all()
    nobody = walkers_of(np.empty((0, 3)), np.empty(0, dtype=np.int64), PeopleConfig(), np.random.default_rng(0))
    assert nobody.target.shape == (0, 2)


def test_a_walker_who_stands_turns_to_face_what_they_are_told_to():
    walkers = walkers_to([[0.0, 0.0]])
    walkers.facing[0] = math.pi / 2
    path = simulate([[0.0, 0.0, 0.0]], walkers, 4.0)
    assert path[-1, 0, :3].tolist() == pytest.approx([0.0, 0.0, math.pi / 2], abs=0.01)
    assert path[:, 0, 5].max() == 1.5


def test_acceleration_stays_within_its_limit():
    habits = habits_of(PeopleConfig(max_acceleration=0.3))
    path = simulate([[0.0, 0.0, 0.0]], walkers_to([[9.0, 0.0]]), 1.0, habits=habits)
    assert np.diff(path[:, 0, 3], prepend=0.0)[:10] == pytest.approx(np.full(10, 0.3 * STEP))


def test_who_is_out_of_view_counts_less():
    poses, behind = [[0.0, 0.0, 0.0]], HALL._replace(discs=np.array([[-0.8, 0.0, 0.25]]))
    ahead = []
    for weight in (1.0, 0.5, 0.0):
        habits = habits_of(PeopleConfig(unseen_weight=weight))
        ahead.append(simulate(poses, walkers_to([[9.0, 0.0]]), 0.5, around=behind, habits=habits)[-1, 0, 0])
    assert ahead[2] == simulate(poses, walkers_to([[9.0, 0.0]]), 0.5)[-1, 0, 0]
    assert ahead[0] > ahead[1] > ahead[2]
