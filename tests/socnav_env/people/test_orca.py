import math
import sys

import numpy as np
import pytest

from socnav_env.config import ConfigError, EnvConfig, PeopleConfig
from socnav_env.people.orca import OrcaWalk
from socnav_env.people.walkers import Surroundings, Walkers, habits_of
from socnav_env.scenes.population import sample_layout
from socnav_env.scenes.rooms import rectangular_room
from socnav_env.simulation.world import World

STEP = 0.05  # s
HALL = Surroundings(rectangular_room(40, 40).walls, np.empty((0, 3)), np.empty((0, 6)))
FAR_ROBOT = [0.0, 19.0, 0.0]


@pytest.fixture(autouse=True, scope="module")
def library():
    pytest.importorskip("pyrvo", reason='people.model "orca" needs the extra: pip install "socnav2[orca]"')


def simulate(poses, targets, seconds, robot=FAR_ROBOT, notice=1.0, around=HALL, **values):
    """Follow the velocities chosen, without contacts. Returns (steps, num_walkers, 6)."""
    count, people = len(poses), PeopleConfig(model="orca", **values)
    alone, none = np.arange(count), np.full(count, np.nan)
    walkers = Walkers(
        np.full(count, 0.8), alone, np.zeros(count), np.array(targets), np.full(count, 99.0), np.zeros(count), none
    )
    bodies = np.zeros((count + 1, 6))
    bodies[:-1, :3], bodies[-1, :3] = poses, robot
    velocities, history = np.zeros((count + 1, 3)), []
    orca, habits = OrcaWalk(people, 0.25, around, count, STEP), habits_of(people)
    for _ in range(round(seconds / STEP)):
        orca.walk(STEP, bodies, walkers, 0.0, notice, habits, velocities)
        bodies[:, 3:] = velocities
        bodies[:, :3] += STEP * velocities
        history.append(bodies[:-1].copy())
    return np.array(history)


def test_two_who_meet_pass_each_other_without_touching():
    path = simulate([[-3.0, 0.02, 0.0], [3.0, 0.0, math.pi]], [[4.0, 0.0], [-4.0, 0.0]], 14.0)
    apart = np.hypot(*(path[:, 0, :2] - path[:, 1, :2]).T)
    assert 0.5 <= apart.min() < 0.8
    assert math.dist(path[-1, 0, :2], (4.0, 0.0)) < 0.3
    assert math.dist(path[-1, 1, :2], (-4.0, 0.0)) < 0.3


def test_someone_who_stands_is_gone_around():
    path = simulate([[-3.0, 0.0, 0.0]], [[3.0, 0.0]], 12.0, around=HALL._replace(discs=np.array([[0.0, 0.05, 0.25]])))
    assert np.hypot(path[:, 0, 0], path[:, 0, 1] - 0.05).min() > 0.5
    assert math.dist(path[-1, 0, :2], (3.0, 0.0)) < 0.3


def test_an_object_is_not_walked_into():
    around = HALL._replace(boxes=np.array([[0.0, 0.1, 1.0, 0.0, 0.5, 0.4]]))
    path = simulate([[-3.0, 0.0, 0.0]], [[3.0, 0.0]], 12.0, around=around)
    assert path[:, 0, 0].max() == pytest.approx(-0.5 - 0.3, abs=0.01)  # half the object, body and margin


@pytest.mark.parametrize(("notice", "least", "most"), [(1.0, 0.5, 0.8), (0.0, 0.0, 0.05)])
def test_the_robot_is_gone_around_where_it_is_noticed(notice, least, most):
    path = simulate([[-3.0, 0.02, 0.0]], [[3.0, 0.0]], 12.0, robot=[0.0, 0.0, 0.0], notice=notice)
    assert least <= np.hypot(path[:, 0, 0], path[:, 0, 1]).min() <= most


def test_the_acceleration_stays_below_what_the_config_allows():
    path = simulate([[-3.0, 0.0, 0.0]], [[3.0, 0.0]], 2.0, max_acceleration=0.5)
    assert np.diff(path[:, 0, 3]).max() == pytest.approx(0.5 * STEP)


def test_a_world_of_people_who_walk_by_orca_repeats_itself():
    config = EnvConfig.from_dict({"people": {"model": "orca"}, "population": {"wandering": [4, 4]}})
    ends = []
    for _ in range(2):
        rng = np.random.default_rng(3)
        world = World(sample_layout(config, rng), config, rng)
        for _ in range(30):
            world.advance(np.zeros(3))
        ends.append(world.people_poses)
    assert ends[0].tolist() == ends[1].tolist()
    assert np.abs(ends[0] - world.layout.people_poses)[world.layout.people_walk].max() > 0.5


def test_a_missing_library_is_named_in_one_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyrvo", None)
    with pytest.raises(ConfigError, match=r'^people.model "orca" needs the package pyrvo, .* "socnav2\[orca\]"$'):
        OrcaWalk(PeopleConfig(model="orca"), 0.25, HALL, 1, STEP)
