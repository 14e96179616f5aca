import numpy as np

from socnav_env.config import EnvConfig, PopulationConfig, SensorConfig
from socnav_env.layout import Room
from socnav_env.observations import ENTITY_WIDTHS, EntitiesObservation
from tests.socnav_env.puppets import PuppetWorld, make_layout


def observed(world: PuppetWorld, config: EnvConfig | None = None) -> dict[str, np.ndarray]:
    return EntitiesObservation(config or EnvConfig()).observe(world, time_left=0.75)


def rows(observation: dict[str, np.ndarray], name: str) -> np.ndarray:
    return observation[name].reshape(-1, ENTITY_WIDTHS[name])


def test_the_robot_sees_itself_and_its_goal() -> None:
    world = PuppetWorld(make_layout(robot_pose=np.array([1.0, 0.0, np.pi / 2]), goal=np.array([1.5, 2.0])))
    world.robot_velocity = np.array([-0.1, 0.3, 0.2])
    observation = observed(world)
    np.testing.assert_allclose(observation["robot"], [0.3, 0.1, 0.2, 0.75], atol=1e-6)
    np.testing.assert_allclose(observation["goal"], [2.0, -0.5], atol=1e-6)


def test_people_come_with_heading_velocity_over_ground_and_whether_they_interact() -> None:
    layout = make_layout(
        robot_pose=np.array([0.0, 0.0, np.pi / 2]),
        people_poses=np.array([[1.0, 2.0, 0.0], [1.0, -1.0, np.pi / 2], [-1.0, 0.0, np.pi]]),
        people_walk=np.array([True, False, False]),
        people_group=np.full(3, -1),
        interaction_pairs=np.array([[1, 2]]),
    )
    world = PuppetWorld(layout)
    world.robot_velocity = np.array([0.0, 0.3, 0.2])  # is not subtracted
    world.people_velocities[0] = [0.6, 0.0, 0.5]
    observation = observed(world)
    np.testing.assert_allclose(
        rows(observation, "people")[:4],
        [
            [2.0, -1.0, 0.0, -1.0, 0.0, -0.6, 0.5, 0.0],
            [-1.0, -1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0],
            [0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            np.zeros(8),
        ],
        atol=1e-6,
    )
    np.testing.assert_array_equal(observation["people_mask"][:4], [1, 1, 1, 0])


def test_objects_walls_and_interactions_in_the_frame_of_the_robot() -> None:
    observation = observed(PuppetWorld(make_layout(robot_pose=np.array([1.0, 0.0, np.pi / 2]))))
    table = [0.0, 3.0, 0.0, -1.0, 0.8, 0.6]
    np.testing.assert_allclose(rows(observation, "objects")[:3], [table, table, np.zeros(6)], atol=1e-6)
    np.testing.assert_array_equal(observation["objects_mask"][:3], [1, 1, 0])
    np.testing.assert_allclose(
        rows(observation, "walls"),
        [[-3, 4, -3, -2], [-3, -2, 3, -2], [3, -2, 3, 4], [3, 4, -3, 4], [0, 0, 0, 0], [0, 0, 0, 0]],
        atol=1e-6,
    )
    np.testing.assert_array_equal(observation["walls_mask"], [1, 1, 1, 1, 0, 0])
    np.testing.assert_allclose(rows(observation, "interactions")[:2], [[2, 0, -1, 0], [0, 0, 0, 0]], atol=1e-6)
    np.testing.assert_array_equal(observation["interactions_mask"], [1, 0, 0])


def test_of_too_many_people_the_nearest_are_seen_in_their_order() -> None:
    config = EnvConfig(population=PopulationConfig(still=(0, 2), wandering=(0, 0), interactions=(0, 0)))
    layout = make_layout(
        people_poses=np.array([[2.0, 0.0, 0.0], [2.9, 0.0, 0.0], [1.0, 0.0, 0.0]]),
        people_walk=np.zeros(3, dtype=np.bool_),
        people_group=np.full(3, -1),
        interaction_pairs=np.zeros((0, 2), dtype=np.int64),
        interaction_relations=(),
    )
    observation = observed(PuppetWorld(layout), config)
    np.testing.assert_allclose(rows(observation, "people")[:, 0], [2.0, 1.0])


def test_of_too_many_walls_those_with_the_nearest_point_are_seen() -> None:
    corners = np.array([[-1, -9], [1, -9], [1, 0.5], [9, 0.5], [9, 1.5], [-1, 1.5]], dtype=np.float64)
    world = PuppetWorld(make_layout(room=Room(corners)))
    seen = observed(world, EnvConfig(sensors=SensorConfig(max_walls=4)))
    expected = [[1, -9, 1, 0.5], [1, 0.5, 9, 0.5], [9, 1.5, -1, 1.5], [-1, 1.5, -1, -9]]
    np.testing.assert_allclose(rows(seen, "walls"), expected, atol=1e-6)
    np.testing.assert_array_equal(seen["walls_mask"], np.ones(4))


def test_a_kind_that_the_config_rules_out_has_no_box() -> None:
    config = EnvConfig(population=PopulationConfig(interactions=(0, 0), tables=(0, 0), plants=(0, 0)))
    layout = make_layout(
        object_poses=np.zeros((0, 3)),
        object_sizes=np.zeros((0, 2)),
        object_kinds=np.zeros(0, dtype=np.int64),
        interaction_pairs=np.zeros((0, 2), dtype=np.int64),
        interaction_relations=(),
    )
    observation = EntitiesObservation(config)
    names = {"robot", "goal", "people", "people_mask", "walls", "walls_mask"}
    assert set(observation.space().spaces) == names
    assert set(observation.observe(PuppetWorld(layout), 1.0)) == names


def test_values_beyond_the_box_are_clipped_to_it() -> None:
    world = PuppetWorld(make_layout(goal=np.array([1e6, -1e6])))
    world.people_velocities[:] = 1e6
    observation = EntitiesObservation(EnvConfig())
    assert observation.space().contains(observation.observe(world, 1.0))


def test_default_sizes_follow_from_the_population() -> None:
    population = PopulationConfig(still=(0, 1), wandering=(0, 2), tables=(0, 1), plants=(0, 3), interactions=(0, 1))
    space = EntitiesObservation(EnvConfig(population=population)).space()
    assert space["people"].shape == ((1 + 2 + 2) * 8,)
    assert space["objects"].shape == ((2 * 1 + 3 + 2) * 6,)
    assert space["interactions"].shape == (4,)
    assert space["walls"].shape == (24,)
    assert all(box.dtype == np.float32 and box.is_bounded() for box in space.values())
