import math

import numpy as np
import pymunk
import pytest

from socnav_env.config import EnvConfig, SensorConfig
from socnav_env.observations import LidarObservation
from socnav_env.scenes.population import sample_layout
from socnav_env.simulation.world import World
from tests.socnav_env.puppets import make_layout


def lidar(**sensors) -> LidarObservation:
    return LidarObservation(EnvConfig(sensors=SensorConfig(**sensors)))


def test_beams_are_spread_from_right_to_left() -> None:
    np.testing.assert_allclose(lidar(lidar_beams=4).beams, np.radians([-135, -45, 45, 135]))
    np.testing.assert_allclose(lidar(lidar_beams=3, field_of_view=math.pi / 2).beams, np.radians([-30, 0, 30]))
    assert len(lidar().beams) == 64


def test_a_scan_of_a_room_measured_by_hand() -> None:
    layout = make_layout(
        robot_pose=np.array([0.0, 0.0, math.pi / 2]),
        people_poses=np.array([[0.0, 2.0, 0.0]]),
        people_walk=np.array([False]),
        people_group=np.array([-1]),
        interaction_pairs=np.zeros((0, 2), dtype=np.int64),
        interaction_relations=(),
    )
    world = World(layout, EnvConfig(), np.random.default_rng(0))
    seen = lidar(lidar_beams=3, field_of_view=1.5 * math.pi).observe(world, 0.25)  # right, ahead, left
    np.testing.assert_allclose(seen["lidar"], [3.0, 2.0 - 0.25, 2.0 - 0.4], atol=1e-6)
    np.testing.assert_allclose(seen["goal"], [0.0, -2.0], atol=1e-6)
    np.testing.assert_allclose(seen["robot"], [0.0, 0.0, 0.0, 0.25], atol=1e-6)
    short = lidar(lidar_beams=3, field_of_view=1.5 * math.pi, lidar_range=1.7).observe(world, 0.25)
    np.testing.assert_allclose(short["lidar"], [1.7, 1.7, 1.6], atol=1e-6)


@pytest.mark.parametrize("seed", range(6))
def test_the_physics_finds_the_same_things_at_the_same_distances(seed: int) -> None:
    config = EnvConfig()
    random = np.random.default_rng(seed)
    world = World(sample_layout(config, random), config, random)
    for _ in range(20):
        world.advance(np.array([0.3, 0.0, 0.3]))
    scanner = lidar()
    space, pose = world._physics._space, world.robot_pose
    robot = next(shape for shape in space.shapes if shape.collision_type == 1)
    expected = []
    for angle in pose[2] + scanner.beams:
        end = pose[:2] + 10.0 * np.array([math.cos(angle), math.sin(angle)])
        hits = space.segment_query(tuple(pose[:2]), tuple(end), 0.0, pymunk.ShapeFilter())
        expected.append(10.0 * min((hit.alpha for hit in hits if hit.shape is not robot), default=1.0))
    np.testing.assert_allclose(scanner.observe(world, 1.0)["lidar"], expected, atol=1e-4)
