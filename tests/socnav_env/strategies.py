"""Random configurations that can work, for tests that must hold for all of them."""

from __future__ import annotations

import math

from hypothesis import strategies as st

from socnav_env import scenarios
from socnav_env.config import (
    RELATIONS,
    ROOM_KINDS,
    EnvConfig,
    PeopleConfig,
    PopulationConfig,
    RobotConfig,
    RoomConfig,
    SensorConfig,
)
from socnav_env.config.robot import DRIVES

SCENARIOS = scenarios.names()


def ranges(least: int, most: int):
    """(from, to) of whole numbers."""
    return st.tuples(st.integers(least, most), st.integers(least, most)).map(lambda pair: (min(pair), max(pair)))


def names(valid: tuple[str, ...]):
    """Some of them, each once."""
    return st.lists(st.sampled_from(valid), min_size=1, unique=True).map(tuple)


def numbers(least: float, most: float):
    return st.floats(least, most, allow_nan=False)


rooms = st.builds(
    RoomConfig,
    kinds=names(ROOM_KINDS),
    square_side=ranges(6, 10),
    rectangle_side=ranges(6, 10),
    l_unit=ranges(3, 4),
)
populations = st.builds(
    PopulationConfig,
    still=ranges(0, 2),
    wandering=ranges(0, 3),
    tables=ranges(0, 2),
    plants=ranges(0, 2),
    interactions=ranges(0, 2),
    relations=names(RELATIONS),
)
crowds = st.builds(
    PeopleConfig,
    robot_visibility=numbers(0.0, 1.0),
    target_interval=numbers(2.0, 12.0),
    avoidance=numbers(0.0, 5.0),
)
robots = st.builds(
    RobotConfig,
    drive=st.sampled_from(list(DRIVES)),
    max_forward_speed=numbers(0.1, 2.0),
    max_backward_speed=numbers(0.0, 1.0),
    max_sideways_speed=numbers(0.0, 1.0),
    max_turn_rate=numbers(0.1, 4.0),
    max_acceleration=st.none() | numbers(0.1, 5.0),
    max_turn_acceleration=st.none() | numbers(0.1, 5.0),
    speed_noise=st.just(0.0) | numbers(0.01, 0.2),
    turn_noise=st.just(0.0) | numbers(0.01, 0.5),
    arrival_radius=numbers(0.2, 1.0),
)
sensors = st.builds(
    SensorConfig,
    field_of_view=st.just(2 * math.pi) | numbers(0.5, 6.0),
    max_range=st.none() | numbers(0.5, 8.0),
    occlusion=st.booleans(),
    position_noise=st.just(0.0) | numbers(0.01, 1.0),
    heading_noise=st.just(0.0) | numbers(0.01, 1.0),
    velocity_noise=st.just(0.0) | numbers(0.01, 1.0),
    nearest_people=st.integers(0, 8),
    nearest_objects=st.integers(0, 8),
    lidar_beams=st.integers(1, 100),
    lidar_range=numbers(1.0, 20.0),
)


@st.composite
def env_configs(draw) -> EnvConfig:
    """The clock ticks in whole numbers of physics steps; everything else is drawn on its own."""
    physics_step = draw(st.sampled_from((0.025, 0.05)))
    control_period = physics_step * draw(st.integers(1, 8))
    return EnvConfig(
        control_period=control_period,
        physics_step=physics_step,
        time_limit=control_period * draw(st.integers(1, 200)),
        warm_up=control_period * draw(st.integers(0, 20)),
        room=draw(rooms),
        population=draw(populations),
        people=draw(crowds),
        robot=draw(robots),
        sensors=draw(sensors),
    )
