import gc
import math
import weakref

import numpy as np
import pymunk.batch
import pytest

from socnav_env.config import EnvConfig
from socnav_env.people.walkers import Surroundings
from socnav_env.simulation.physics import OBJECT, PERSON, READ, WALL, WRITE, Physics, physics_step

STEP = 0.05  # s
WALKERS = [[2.0, 0.0, 0.0], [0.0, 2.0, 1.0], [0.5, 2.0, 1.0]]
NOTHING = Surroundings(np.empty((0, 4)), np.empty((0, 3)), np.empty((0, 6)))


def physics_of(walkers=WALKERS, around=NOTHING, groups=None):
    physics = Physics(len(walkers), EnvConfig())
    physics.bodies.states[:, :3] = [*walkers, [0.0, 0.0, 0.0]]
    physics.fill(np.arange(len(walkers)) if groups is None else np.array(groups), around)
    return physics


def test_bodies_move_with_the_velocities_that_are_set():
    physics = physics_of()
    physics.bodies.velocities[:] = [[1.0, 0.0, 0.0], [0.0, 2.0, 0.5], [0.0, 0.0, 0.0], [-1.0, 0.0, -1.0]]
    physics_step(physics.bodies, STEP)
    expected = [
        [2.05, 0.0, 0.0, 1.0, 0.0, 0.0],
        [0.0, 2.1, 1.025, 0.0, 2.0, 0.5],
        [0.5, 2.0, 1.0, 0.0, 0.0, 0.0],
        [-0.05, 0.0, -0.05, -1.0, 0.0, -1.0],
    ]
    assert physics.bodies.states == pytest.approx(np.array(expected), abs=1e-12)


def test_it_is_pymunks_own_step_bit_for_bit():
    around = Surroundings(
        np.array([[-3.0, -1.0, 3.0, -1.0], [2.6, -3.0, 2.6, 3.0]]),
        np.array([[1.0, 1.0, 0.25]]),
        np.array([[-1.0, 0.0, 1.0, 0.0, 0.4, 0.4]]),
    )
    ours, theirs = physics_of(around=around), physics_of(around=around)
    space, write, read = theirs._space, pymunk.batch.Buffer(), pymunk.batch.Buffer()
    velocities = np.zeros((5, 3))  # with a row for the body that is fixed
    write.set_float_buf(velocities)
    random = np.random.default_rng(0)
    for _ in range(400):
        velocities[:-1] = random.uniform(-2, 2, (4, 3))
        ours.bodies.velocities[:] = velocities[:-1]
        physics_step(ours.bodies, STEP)
        pymunk.batch.set_space_bodies(space, WRITE, write)
        space.step(STEP)
        read.clear()
        pymunk.batch.get_space_bodies(space, READ, read)
        np.testing.assert_array_equal(ours.bodies.states.ravel(), np.frombuffer(read.float_buf())[:24])
        np.testing.assert_array_equal(ours.bodies.touched, theirs.bodies.touched)
    assert ours.bodies.touched[[PERSON, OBJECT, WALL]].any()


@pytest.mark.parametrize(
    ("kind", "around", "walkers"),
    [
        (PERSON, NOTHING, [[0.56, 0.0, 0.0]]),
        (PERSON, NOTHING._replace(discs=np.array([[0.56, 0.0, 0.25]])), []),
        (OBJECT, NOTHING._replace(boxes=np.array([[0.71, 0.0, 1.0, 0.0, 0.4, 0.4]])), []),
        (WALL, NOTHING._replace(walls=np.array([[0.31, -1.0, 0.31, 1.0]])), []),
    ],
)
def test_it_says_what_the_robot_touches(kind, around, walkers):
    physics = physics_of(walkers, around)
    bodies = physics.bodies
    for _ in range(3):
        assert not bodies.touched.any()
        bodies.velocities[-1] = [0.5, 0.0, 0.0]
        physics_step(bodies, STEP)
    assert np.flatnonzero(bodies.touched).tolist() == [kind]


@pytest.mark.parametrize(("groups", "apart"), [([0, 0], False), ([0, 1], True)])
def test_only_people_of_one_group_may_overlap(groups, apart):
    physics = physics_of([[1.0, 1.0, 0.0], [1.3, 1.0, 0.0]], groups=groups)
    bodies = physics.bodies
    for _ in range(100):
        bodies.velocities[:] = 0.0
        physics_step(bodies, STEP)
    assert (math.dist(bodies.states[0, :2], bodies.states[1, :2]) > 0.48) is apart


def test_nothing_is_left_for_python_to_search():
    around = NOTHING._replace(
        walls=np.array([[0.31, -1.0, 0.31, 1.0]]), boxes=np.array([[0.7, 0.0, 1.0, 0.0, 0.4, 0.4]])
    )
    gc.disable()
    try:
        physics = physics_of(around=around)
        for _ in range(3):
            physics.bodies.velocities[:] = 0.5
            physics_step(physics.bodies, STEP)
        assert physics.bodies.touched.any()
        space = physics._space
        parts = [weakref.ref(part) for part in (space, *space.bodies, *space.shapes, space.static_body)]
        del space, physics
        assert [part() for part in parts] == [None] * len(parts)
    finally:
        gc.enable()
