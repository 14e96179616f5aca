import json
import math
import subprocess
import sys

import pytest

from socnav_env.config import (
    AT_PLANT,
    TALKING,
    ConfigError,
    EnvConfig,
    PopulationConfig,
    RewardConfig,
    RobotConfig,
)
from socnav_env.config.robot import DRIVES


def test_defaults_hold_what_raters_saw():
    config = EnvConfig()
    assert (config.substeps, config.warm_up_steps, config.max_steps) == (4, 10, 300)
    assert config.robot.max_forward_speed == pytest.approx(0.37234, abs=1e-5)
    assert config.robot.max_turn_rate == pytest.approx(0.38760, abs=1e-5)
    assert config.people.stop_distance == 1.2


def test_capacities_follow_from_the_counts():
    population = PopulationConfig(still=(1, 2), wandering=(0, 3), tables=(0, 2), plants=(0, 1), interactions=(0, 2))
    assert (population.max_people, population.max_objects, population.max_interactions) == (9, 9, 2)
    population = PopulationConfig(still=(0, 1), wandering=(0, 0), tables=(0, 0), plants=(0, 0), relations=(AT_PLANT,))
    assert (population.max_people, population.max_objects) == (4, 3)
    assert PopulationConfig(tables=(0, 0), plants=(0, 0), relations=(TALKING,)).max_objects == 0


def test_a_dict_and_back():
    config = EnvConfig.from_dict({"room": {"kinds": ["l_shape"], "l_unit": [3, 3]}, "people": {"robot_visibility": 0}})
    assert config.room.kinds == ("l_shape",)
    assert config.room.l_unit == (3, 3)
    assert config.people.stop_distance == 1.2
    assert EnvConfig.from_dict(json.loads(json.dumps(config.to_dict()))) == config


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"physics_step": 0.03}, "control_period must be a whole number of physics steps, got 0.2 and 0.03"),
        ({"warm_up": 0.3}, "warm_up must be a whole number of control periods, got 0.3 and 0.2"),
        ({"time_limit": 0.5}, "time_limit must be a whole number of control periods, got 0.5 and 0.2"),
        ({"time_limit": math.nan}, "time_limit must be a number of at least 0.001, got nan"),
        ({"speed": 1}, "unknown key speed, the valid ones are control_period, people, physics_step, population,"),
        ({"people": {"sped": 1}}, "unknown key people.sped, the valid ones are avoidance,"),
        ({"people": 3}, "people must be a table of keys and values, got 3"),
        ({"people": {"clearance": 0.2}}, "people.clearance must be at least people.radius, got 0.2 and 0.25"),
        ({"people": {"robot_visibility": 1.5}}, "people.robot_visibility must be a number from 0 to 1, got 1.5"),
        ({"room": {"square_side": [8, 6]}}, "room.square_side must rise from at least 1, got 8 and 6"),
        ({"room": {"square_side": 8}}, r"room.square_side must be two whole numbers \(least, most\), got 8"),
        ({"room": {"kinds": ["round"]}}, "room.kinds must be of square, rectangle, l_shape, got 'round'"),
        (
            {"room": {"kind_weights": [1]}},
            "room.kind_weights must be one number for each of room.kinds",
        ),
        ({"room": {"turned": 1}}, "room.turned must be true or false, got 1"),
        ({"people": {"model": "wander"}}, "people.model must be one of social_force, orca, standing, got 'wander'"),
        ({"reward": {"time_scale": 0.5}}, "reward.time_scale must be a number of at least 1, got 0.5"),
        ({"people": {"max_acceleration": 0}}, "people.max_acceleration must be a number of at least 0.001, got 0"),
        ({"people": {"group": {"gaze": -1}}}, "people.group.gaze must be a number of at least 0, got -1"),
        ({"people": {"orca": {"margin": -1}}}, "people.orca.margin must be a number of at least 0, got -1"),
        ({"population": {"circle_size": [1, 3]}}, "population.circle_size must rise from at least 2, got 1 and 3"),
        (
            {"population": {"circle_spacing": [0.4, 1.0]}},
            "population.circle_spacing must be at least twice people.radius, got 0.4 and 0.25",
        ),
        (
            {"population": {"conversations": {"max_size": 1}}},
            "population.conversations.max_size must be a whole number of at least 2, got 1",
        ),
        ({"population": {"relation_weights": [0, 0, 0, 0]}}, "population.relation_weights must be one number for each"),
        ({"room": {"kinds": []}}, "room.kinds must name at least one of square"),
        ({"room": {"kinds": ["square", "square"]}}, "room.kinds must name each kind once, got square, square"),
        ({"population": {"still": [0, 2.5]}}, "population.still must be two whole numbers"),
        ({"population": {"still": [True, 2]}}, "population.still must be two whole numbers"),
        ({"population": {"table_sizes": []}}, "population.table_sizes must name at least one size"),
        ({"population": {"plant_size": [0.1, 0]}}, r"size must be two positive numbers, got \(0.1, 0\)"),
        ({"robot": {"radius": "wide"}}, "robot.radius must be a number of at least 0.001, got 'wide'"),
        (
            {"robot": {"min_goal_distance": 0.4}},
            "robot.min_goal_distance must be larger than robot.arrival_radius, got 0.4 and 0.5",
        ),
        ({"reward": {"mix": []}}, "reward.mix must be pairs such as"),
        ({"reward": {"mix": ["learned"]}}, "reward.mix must be pairs such as"),
        ({"reward": {"mix": [["learned", "much"]]}}, "reward.mix: learned must be a number, got 'much'"),
        ({"reward": {"mix": [["q1", 1], ["q1", 2]]}}, "reward.mix must name each reward once, got q1, q1"),
        ({"robot": {"drive": "legs"}}, f"robot.drive must be one of {', '.join(DRIVES)}, got 'legs'"),
        ({"robot": {"max_acceleration": 0}}, "robot.max_acceleration must be a number of at least 0.001, got 0"),
        ({"robot": {"turn_noise": -1}}, "robot.turn_noise must be a number of at least 0, got -1"),
        ({"robot": {"speed_noise": 2.0}}, "robot: at top speed .* got 8.85762 m/s x 0.05 s and 0.25 m"),
        ({"robot": {"max_forward_speed": 6.0}}, "robot: at top speed .* got 6 m/s x 0.05 s and 0.25 m"),
        (
            {"population": {"still": [30, 30]}, "room": {"kinds": ["rectangle"]}},
            "the fewest people and objects asked for need 16.1 m.2, but the smallest rectangle room holds 12.5 m.2",
        ),
    ],
)
def test_what_cannot_work_is_refused(values, message):
    with pytest.raises(ConfigError, match=message):
        EnvConfig.from_dict(values)


def test_importing_the_config_loads_nothing_heavy():
    code = (
        "import sys, socnav_env.config; "
        "print([name for name in ('torch', 'dgl', 'numba', 'pymunk') if name in sys.modules])"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"


@pytest.mark.parametrize(
    ("robot", "factor"),
    [
        (RobotConfig(), 1.0),
        (RobotConfig(max_forward_speed=0.1, max_backward_speed=0.1, max_turn_rate=0.1), 1.0),
        (RobotConfig(max_forward_speed=1.0), 9.4 / 3.5),
        (RobotConfig(max_backward_speed=0.7), 1.88),
        (RobotConfig(max_turn_rate=1.0), 2.58),
        (RobotConfig(max_sideways_speed=0.7), 1.0),
        (RobotConfig(drive="holonomic", max_sideways_speed=0.7), 1.88),
    ],
)
def test_the_factor_that_makes_a_robot_as_slow_as_the_rated_one(robot, factor):
    assert robot.rated_time_scale == pytest.approx(factor)


@pytest.mark.parametrize(
    ("robot", "time_scale", "rated"),
    [
        (RobotConfig(), 1.0, True),
        (RobotConfig(max_forward_speed=1.0), 1.0, False),
        (RobotConfig(max_forward_speed=1.0), 2.68, False),
        (RobotConfig(max_forward_speed=1.0), RobotConfig(max_forward_speed=1.0).rated_time_scale, True),
        (RobotConfig(max_forward_speed=1.0), 2.7, True),
        (RobotConfig(max_forward_speed=1.0, max_turn_rate=1.5), 2.7, False),
        (RobotConfig(drive="holonomic"), 4.0, False),
    ],
)
def test_a_robot_is_in_the_rated_range_as_it_is_judged(robot, time_scale, rated):
    assert EnvConfig(robot=robot, reward=RewardConfig(time_scale=time_scale)).in_rated_range is rated
