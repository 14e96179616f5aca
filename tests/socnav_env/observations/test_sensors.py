import math
from dataclasses import replace

import numpy as np
import pytest

from socnav_env.config import ConfigError, EnvConfig, SensorConfig
from socnav_env.env import SocNavEnv
from socnav_env.layout import Room
from socnav_env.observations.sensors import look
from socnav_env.simulation.world import World
from tests.socnav_env.puppets import make_layout

NOISE = SensorConfig(position_noise=0.1, heading_noise=0.2, velocity_noise=0.3)


def world_of(**changes) -> World:
    return World(make_layout(**changes), EnvConfig(), np.random.default_rng(0))


def test_by_default_everything_is_seen_exactly() -> None:
    world = world_of()
    sight = look(world, SensorConfig())
    np.testing.assert_array_equal(sight.people_poses, world.people_poses)
    np.testing.assert_array_equal(sight.object_poses, world.layout.object_poses)
    np.testing.assert_array_equal(sight.interaction_pairs, world.layout.interaction_pairs)


def test_interactions_are_seen_where_both_are() -> None:
    """The robot looks east; one of three people stands behind it, and so does the table that another one is at."""
    world = world_of(
        people_poses=np.array([[-2.0, 2.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0]]),
        people_walk=np.zeros(3, dtype=np.bool_),
        people_group=np.full(3, -1),
        object_poses=np.array([[-2.0, 0.0, 0.0], [2.0, 0.0, 0.0]]),
        interaction_pairs=np.array([[0, 1], [1, 2], [2, 3], [2, 4]]),
        interaction_relations=("talk",) * 4,
    )
    sight = look(world, SensorConfig(field_of_view=math.pi))
    np.testing.assert_array_equal(sight.people_poses[:, 1], [1.0, -1.0])
    np.testing.assert_array_equal(sight.object_poses[:, 0], [2.0])
    np.testing.assert_array_equal(sight.interaction_pairs, [[0, 1], [1, 2]])


def test_noise_is_of_the_size_asked_for_and_new_at_every_step() -> None:
    world = world_of()
    errors = []
    for _ in range(400):
        sight = look(world, NOISE)
        objects = sight.object_poses - world.layout.object_poses
        people = sight.people_poses - world.people_poses
        errors.append([*people[0], *objects[1], *(sight.people_velocities - world.people_velocities)[0]])
        world.advance(np.zeros(3))
    deviations = np.std(errors, axis=0)
    np.testing.assert_allclose(deviations, [0.1, 0.1, 0.2] * 2 + [0.3, 0.3, 0.0], rtol=0.12)
    assert np.abs(np.mean(errors, axis=0)).max() < 0.05


def test_an_instant_looks_the_same_however_often_one_looks() -> None:
    world = world_of()
    np.testing.assert_array_equal(look(world, NOISE).people_poses, look(world, NOISE).people_poses)


def test_noise_does_not_depend_on_who_else_is_in_view() -> None:
    world = world_of()
    everyone, ahead = look(world, NOISE), look(world, replace(NOISE, field_of_view=math.pi / 2))
    np.testing.assert_array_equal(ahead.people_poses, everyone.people_poses[1:])


@pytest.mark.parametrize("name", ["entities", "flat"])
def test_the_world_does_not_change_with_who_looks(name: str) -> None:
    limits = replace(NOISE, field_of_view=1.0, max_range=3.0, occlusion=True)
    plain = SocNavEnv(reward="crowdnav", observation=name)
    limited = SocNavEnv(reward="crowdnav", observation=name, config=EnvConfig(sensors=limits))
    again = SocNavEnv(reward="crowdnav", observation=name, config=EnvConfig(sensors=limits))
    differ = False
    for env in (plain, limited, again):
        env.reset(seed=3)
    for _ in range(15):
        results = [env.step(np.array([0.5, 0.5])) for env in (plain, limited, again)]
        assert len({result[1] for result in results}) == 1
        np.testing.assert_array_equal(plain.world.people_poses, limited.world.people_poses)
        seen = [np.concatenate([*result[0].values()]) if name == "entities" else result[0] for result in results]
        assert np.array_equal(seen[1], seen[2])
        assert limited.observation_space.contains(results[1][0])
        differ = differ or not np.array_equal(seen[0], seen[1])
    assert differ
    env = SocNavEnv(reward="crowdnav", observation=name, config=EnvConfig(sensors=limits))
    assert not np.array_equal(np.concatenate([*env.reset(seed=1)[0].values()]) if name == "entities" else
                              env.reset(seed=1)[0], seen[1])  # fmt: skip


def test_nothing_is_seen_through_the_corner_of_an_l() -> None:
    corners = np.array([[0, 0], [6, 0], [6, 6], [4, 6], [4, 2], [0, 2]], dtype=np.float64)
    world = world_of(
        room=Room(corners),
        robot_pose=np.array([1.0, 1.0, 0.0]),
        people_poses=np.array([[5.0, 1.0, 0.0], [5.0, 5.0, 0.0]]),
        people_walk=np.zeros(2, dtype=np.bool_),
        object_poses=np.array([[5.5, 1.6, 0.0], [5.5, 4.0, 0.0]]),
    )
    sight = look(world, SensorConfig(occlusion=True))
    np.testing.assert_array_equal(sight.people_poses[:, 1], [1.0])
    np.testing.assert_array_equal(sight.object_poses[:, 1], [1.6])


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"field_of_view": 7.0}, "sensors.field_of_view must be a number from 0.001 to 6.28"),
        ({"max_range": 0}, "sensors.max_range must be a number of at least 0.001, got 0"),
        ({"occlusion": "yes"}, "sensors.occlusion must be true or false, got 'yes'"),
        ({"lidar_beams": 0}, "sensors.lidar_beams must be a whole number of at least 1, got 0"),
        ({"nearest_people": 2.5}, "sensors.nearest_people must be a whole number of at least 0, got 2.5"),
        ({"position_noise": -0.1}, "sensors.position_noise must be a number of at least 0, got -0.1"),
    ],
)
def test_sensors_that_cannot_be_are_refused(values: dict, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        EnvConfig.from_dict({"sensors": values})
