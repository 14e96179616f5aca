"""Scenes over the whole range for which the simulator has a meaning, for a reward model that agents will optimise.

Rooms of 3 to 20 m, 0 to 30 people alone, in conversation, circles and walking groups, robots of up to 1 m/s that
people see or do not see, and robots moved next to, onto and into people, objects and walls. Half of the episodes are
the default environment's.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from reward_model.analysis.heatmap import is_inside, placed
from reward_model.base.arrays import FloatArray
from reward_model.scenes.scene import SceneSequence, Snapshot
from socnav_env.config import ConfigError, EnvConfig, PeopleConfig, PopulationConfig, RobotConfig, RoomConfig
from socnav_env.scenes.population import sample_layout
from socnav_env.simulation.world import World

# As many people and objects as in SocNav2's scenes (up to 14 and 11), more often than by default.
CROWDED: Final = PopulationConfig(still=(0, 6), wandering=(0, 6), tables=(0, 3), plants=(0, 3), interactions=(0, 3))

MAX_PEOPLE: Final = 30
MAX_SPEED, MAX_TURN_RATE = 1.0, 0.5  # m/s and rad/s: beyond these the published network's answers mean little
_SMALLEST_SIDE, _LARGEST_SIDE = 3, 20  # m
_CLOSE: Final = (-0.1, 0.45)  # m between surfaces where the robot is moved next to something
_DEEP: Final = (-0.4, -0.1)  # m, where it is moved into something
_SHARE_DEEP: Final = 0.15


def random_config(rng: np.random.Generator) -> EnvConfig:
    """An environment anywhere in the range; not every one has room for its people."""
    kind = rng.random()
    if kind < 0.5:
        room, population = RoomConfig(), PopulationConfig()
    elif kind < 0.68:
        room, population = RoomConfig(), CROWDED
    elif kind < 0.78:
        room, population = _small_room(rng)
    else:
        room, population = _large_room(rng)
    return EnvConfig(
        room=room,
        population=population,
        robot=_robot(rng),
        people=PeopleConfig(robot_visibility=0.0) if rng.random() < 0.25 else PeopleConfig(),
    )


def random_world(rng: np.random.Generator) -> World:
    """The world of a random environment, which has at most `MAX_PEOPLE`."""
    while True:
        config = random_config(rng)
        try:
            layout = sample_layout(config, rng)
        except ConfigError:
            continue
        if layout.num_people <= MAX_PEOPLE:
            return World(layout, config, rng)


def moved_close(snapshots: tuple[Snapshot, ...], rng: np.random.Generator) -> tuple[Snapshot, ...]:
    """The scene with the robot next to, onto or into a person, an object or a wall, inside of the room."""
    last = snapshots[-1]
    for _ in range(10):
        place = _close_place(last, rng)
        if is_inside(last.walls, place[None])[0]:
            break
    return placed(SceneSequence(snapshots), place).snapshots


def _small_room(rng: np.random.Generator) -> tuple[RoomConfig, PopulationConfig]:
    side = int(rng.integers(_SMALLEST_SIDE, 7))
    room = RoomConfig(square_side=(side, side), rectangle_side=(_SMALLEST_SIDE, side + 1), l_unit=(2, 2))
    few = (0, 2)
    return room, PopulationConfig(still=few, wandering=(0, 3), tables=(0, 1), plants=(0, 1), interactions=(0, 1))


def _large_room(rng: np.random.Generator) -> tuple[RoomConfig, PopulationConfig]:
    side = int(rng.integers(8, _LARGEST_SIDE + 1))
    unit = max(2, side // 3)
    room = RoomConfig(
        square_side=(side, side), rectangle_side=(int(rng.integers(5, side + 1)), side), l_unit=(unit, unit)
    )
    many = int(rng.integers(1, 13))
    population = PopulationConfig(
        still=(0, many),
        wandering=(0, many),
        tables=(0, 4),
        plants=(0, 4),
        interactions=(0, 4),
        circles=(0, int(rng.integers(0, 3))),
        walking_groups=(0, int(rng.integers(0, 3))),
    )
    return room, population


def _robot(rng: np.random.Generator) -> RobotConfig:
    robot = replace(RobotConfig(), min_goal_distance=0.6) if rng.random() < 0.3 else RobotConfig()
    if rng.random() < 0.65:
        return robot
    speed, turn = rng.uniform(0.3, MAX_SPEED), rng.uniform(0.3, MAX_TURN_RATE)
    return replace(robot, max_forward_speed=speed, max_backward_speed=speed, max_turn_rate=turn)


def _close_place(snapshot: Snapshot, rng: np.random.Generator) -> FloatArray:
    """[m] (2,) a place in the robot's frame from which something is as far as drawn from `_CLOSE` or `_DEEP`."""
    between = rng.uniform(*(_DEEP if rng.random() < _SHARE_DEEP else _CLOSE))
    people, objects = len(snapshot.people), len(snapshot.objects)
    chosen = int(rng.integers(people + objects + 2))  # walls as often as two people
    robot = RobotConfig().radius
    if chosen < people:
        angle, away = rng.uniform(-math.pi, math.pi), max(0.02, PeopleConfig().radius + robot + between)
        place: FloatArray = snapshot.people.poses[chosen, :2] + away * np.array([math.cos(angle), math.sin(angle)])
        return place
    if chosen < people + objects:
        return _beside_box(snapshot, chosen - people, robot + between, rng)
    wall = snapshot.walls[rng.integers(len(snapshot.walls))]
    along = wall[2:] - wall[:2]
    normal = np.array([-along[1], along[0]]) / max(1e-9, np.hypot(*along))
    side = 1 if rng.random() < 0.5 else -1
    beside: FloatArray = wall[:2] + rng.random() * along + side * max(0.0, robot + between) * normal
    return beside


def _beside_box(snapshot: Snapshot, index: int, away: float, rng: np.random.Generator) -> FloatArray:
    """A place `away` [m] from the outline of an object, or within it by as much as that is negative."""
    (x, y, heading), half = snapshot.objects.poses[index], snapshot.objects.sizes[index] / 2
    axis, sign = int(rng.integers(2)), 1 if rng.random() < 0.5 else -1
    local = rng.uniform(-half, half)
    local[axis] = sign * max(0.0, half[axis] + away)
    cos, sin = math.cos(heading), math.sin(heading)
    return np.array([x + cos * local[0] - sin * local[1], y + sin * local[0] + cos * local[1]])
