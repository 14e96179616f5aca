import numpy as np

from socnav_env.config import EnvConfig, SensorConfig
from socnav_env.observations import FlatObservation
from tests.socnav_env.puppets import PuppetWorld, make_layout


def test_the_nearest_come_first_and_the_farthest_are_left_out() -> None:
    layout = make_layout(
        people_poses=np.array([[2.5, 0.0, 0.0], [-1.0, 0.0, np.pi], [0.0, 2.0, np.pi / 2]]),
        people_walk=np.zeros(3, dtype=np.bool_),
        people_group=np.full(3, -1),
        interaction_pairs=np.array([[2, 3]]),
    )
    world = PuppetWorld(layout)
    world.people_velocities[1] = [0.3, -0.2, 0.1]
    world.robot_velocity = np.array([0.1, 0.0, 0.2])
    flat = FlatObservation(EnvConfig(sensors=SensorConfig(nearest_people=2, nearest_objects=3)))
    seen = flat.observe(world, 0.5)
    parts = {name: seen[part] for name, part in flat.slices.items()}
    np.testing.assert_allclose(parts["robot"], [0.1, 0.0, 0.2, 0.5], atol=1e-6)
    np.testing.assert_allclose(parts["goal"], [2.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(
        parts["people"].reshape(2, 8),
        [[-1.0, 0.0, -1.0, 0.0, 0.3, -0.2, 0.1, 0.0], [0.0, 2.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]],
        atol=1e-6,
    )
    np.testing.assert_array_equal(parts["people_mask"], [1, 1])
    np.testing.assert_array_equal(parts["objects_mask"], [1, 1, 0])
    table = [-2.0, 0.0, 1.0, 0.0, 0.8, 0.6]
    np.testing.assert_allclose(parts["objects"].reshape(3, 6), [table, table, np.zeros(6)], atol=1e-6)
    np.testing.assert_array_equal(parts["walls_mask"], [1, 1, 1, 1, 0, 0])


def test_walls_are_sorted_by_their_nearest_point() -> None:
    world = PuppetWorld(make_layout(robot_pose=np.array([0.0, 2.5, 0.0])))
    flat = FlatObservation(EnvConfig())
    walls = flat.observe(world, 1.0)[flat.slices["walls"]].reshape(-1, 4)
    np.testing.assert_allclose(walls[0], [3.0, 0.5, -3.0, 0.5], atol=1e-6)
    np.testing.assert_allclose(walls[3], [-3.0, -5.5, 3.0, -5.5], atol=1e-6)


def test_the_size_is_that_of_all_parts() -> None:
    flat = FlatObservation(EnvConfig())
    assert flat.size == 4 + 2 + 5 * 9 + 5 * 7 + 6 * 5
    assert flat.space().shape == (flat.size,)
    nobody = FlatObservation(EnvConfig(sensors=SensorConfig(nearest_people=0, nearest_objects=0)))
    assert nobody.space().shape == (4 + 2 + 6 * 5,)
    assert nobody.space().contains(nobody.observe(PuppetWorld(), 1.0))
