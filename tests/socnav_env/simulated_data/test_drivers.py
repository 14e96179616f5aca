"""Drivers: what they are for shows in where the robot ends up."""

import numpy as np
import pytest

from socnav_env.config import EnvConfig, PeopleConfig, PopulationConfig
from socnav_env.scenes.population import sample_layout
from socnav_env.simulated_data.drivers import DRIVERS
from socnav_env.simulation.world import World

EMPTY = PopulationConfig(still=(0, 0), wandering=(0, 0), tables=(0, 0), plants=(0, 0), interactions=(0, 0))
CONFIG = EnvConfig(population=EMPTY, people=PeopleConfig())


def driven(name: str, seed: int, steps: int = 60) -> tuple[World, float]:
    """The world after some control periods, and the distance to the goal before them."""
    rng = np.random.default_rng(seed)
    world = World(sample_layout(CONFIG, rng), CONFIG, rng)
    before = world.distance_to_goal()
    driver = DRIVERS[name](rng)
    for _ in range(steps):
        world.advance(driver.command(world, rng))
    return world, before


@pytest.mark.parametrize("name", DRIVERS)
def test_commands_stay_within_the_robot(name):
    rng = np.random.default_rng(0)
    config = EnvConfig()
    world = World(sample_layout(config, rng), config, rng)
    driver = DRIVERS[name](rng)
    for _ in range(50):
        forward, left, turn = driver.command(world, rng)
        assert left == 0.0
        assert -config.robot.max_backward_speed <= forward <= config.robot.max_forward_speed
        assert abs(turn) <= config.robot.max_turn_rate
        world.advance(np.array([forward, left, turn]))


def test_goal_seeker_comes_closer():
    gains = [before - world.distance_to_goal() for world, before in (driven("goal", seed) for seed in range(8))]
    assert np.mean(gains) > 0.5


def test_fugitive_gets_away():
    gains = [before - world.distance_to_goal() for world, before in (driven("fugitive", seed) for seed in range(8))]
    assert np.mean(gains) < -0.1


def test_reverser_moves_backwards():
    rng = np.random.default_rng(1)
    world = World(sample_layout(CONFIG, rng), CONFIG, rng)
    assert DRIVERS["reverser"](rng).command(world, rng)[0] < 0


def test_stander_stays():
    rng = np.random.default_rng(1)
    world = World(sample_layout(CONFIG, rng), CONFIG, rng)
    before = world.robot_pose
    world.advance(DRIVERS["stander"](rng).command(world, rng))
    assert np.array_equal(world.robot_pose, before)
