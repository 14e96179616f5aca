"""Drivers of the robot, good and bad, so that training scenes show both.

SocNav2's scenes were driven by an imperfect policy and by people with a joystick who sought out rare situations
(reversing out of a block, waiting for people to pass). A driver here is a class with `command(world, rng)`, called
once each control period; `DRIVERS` lists them.
"""

from __future__ import annotations

import math
from typing import Final, Protocol

import numpy as np

from reward_model.base.angles import wrap_heading
from reward_model.base.arrays import FloatArray
from socnav_env.simulation.world import World


class Driver(Protocol):
    """Drives one robot through one scene; it may keep a state."""

    def __init__(self, rng: np.random.Generator) -> None: ...

    def command(self, world: World, rng: np.random.Generator) -> FloatArray:
        """The command: (3,) forward speed [m/s], speed to the left [m/s] and turn rate [rad/s]."""
        ...


class GoalSeeker:
    """Turns to the goal and drives straight there, without avoiding people."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._speed = rng.uniform(0.3, 1.0)
        self._sloppiness = rng.uniform(0.0, 0.6)

    def command(self, world: World, rng: np.random.Generator) -> FloatArray:
        """Drive towards the goal, steering with some error."""
        return _towards(world, world.layout.goal, self._speed, rng.normal(0.0, self._sloppiness))


class PoliteSeeker(GoalSeeker):
    """Like `GoalSeeker`, but waits while a person is close ahead."""

    def __init__(self, rng: np.random.Generator) -> None:
        super().__init__(rng)
        self._distance = rng.uniform(0.4, 1.5)  # m between surfaces

    def command(self, world: World, rng: np.random.Generator) -> FloatArray:
        """Drive towards the goal, or stand while a person is close ahead."""
        command = super().command(world, rng)
        if _someone_ahead(world, self._distance):
            command[0] = 0.0
        return command


class Chaser(GoalSeeker):
    """Drives at the nearest person."""

    def command(self, world: World, rng: np.random.Generator) -> FloatArray:
        """Drive towards the nearest person; towards the goal in an empty room."""
        people = world.people_poses[:, :2]
        if not len(people):
            return super().command(world, rng)
        nearest = people[np.argmin(world.clearance_to_people())]
        return _towards(world, nearest, self._speed, rng.normal(0.0, self._sloppiness))


class Fugitive(GoalSeeker):
    """Drives away from the goal."""

    def command(self, world: World, rng: np.random.Generator) -> FloatArray:
        """Drive to the goal's mirror image behind the robot."""
        away = 2 * world.robot_pose[:2] - world.layout.goal
        return _towards(world, away, self._speed, rng.normal(0.0, self._sloppiness))


class Cruiser:
    """Drives straight on or along a wide arc: past the goal, up to a wall."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._forward, self._turn = rng.uniform(0.3, 1.0), rng.normal(0.0, 0.1)

    def command(self, world: World, rng: np.random.Generator) -> FloatArray:
        """Drive on."""
        robot = world.config.robot
        return _command(self._forward * robot.max_forward_speed, self._turn * robot.max_turn_rate)


class Reverser:
    """Drives backwards and steers now and then, as people with a joystick leave a dead end."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._speed = rng.uniform(0.3, 1.0)
        self._to_goal = bool(rng.random() < 0.5)

    def command(self, world: World, rng: np.random.Generator) -> FloatArray:
        """Drive backwards, with the back to the goal or with random steering."""
        robot = world.config.robot
        turn = rng.normal(0.0, 0.5)
        if self._to_goal:
            turn += 2 * wrap_heading(_bearing(world, world.layout.goal) + math.pi)
        return _command(-self._speed * robot.max_backward_speed, _limited(turn) * robot.max_turn_rate)


class Joystick:
    """Holds one random command for a moment, then another: drifts, arcs, spins and stops."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._left = 0  # control periods for which the command is held
        self._held = np.zeros(3)

    def command(self, world: World, rng: np.random.Generator) -> FloatArray:
        """Hold or renew the command."""
        if self._left <= 0:
            robot = world.config.robot
            forward = _limited(rng.uniform(-0.6, 1.4)) * robot.max_forward_speed
            turn = _limited(rng.uniform(-1.5, 1.5)) * robot.max_turn_rate
            kept_forward, kept_turn = rng.random(2) < 0.8
            self._held = _command(forward * kept_forward, turn * kept_turn)
            self._left = int(rng.integers(2, 16))
        self._left -= 1
        return self._held.copy()


class Stander:
    """Stands still, as if waiting."""

    def __init__(self, rng: np.random.Generator) -> None:
        pass

    def command(self, world: World, rng: np.random.Generator) -> FloatArray:
        """Stand."""
        return np.zeros(3)


DRIVERS: Final[dict[str, type[Driver]]] = {
    "goal": GoalSeeker,
    "polite": PoliteSeeker,
    "chaser": Chaser,
    "fugitive": Fugitive,
    "cruiser": Cruiser,
    "reverser": Reverser,
    "joystick": Joystick,
    "stander": Stander,
}


def _command(forward: float, turn: float) -> FloatArray:
    """A command without sideways speed, which every drive accepts."""
    return np.array([forward, 0.0, turn])


def _towards(world: World, place: FloatArray, speed: float, error: float) -> FloatArray:
    """Turn to a place and drive, slower the more it lies to the side. speed: share of the robot's top speed."""
    robot = world.config.robot
    bearing = _bearing(world, place)
    forward = speed * max(0.0, math.cos(bearing)) ** 2
    return _command(forward * robot.max_forward_speed, _limited(2.0 * bearing + error) * robot.max_turn_rate)


def _bearing(world: World, place: FloatArray) -> float:
    """Angle from the robot's heading to a place [rad]."""
    x, y, heading = world.robot_pose
    return wrap_heading(math.atan2(place[1] - y, place[0] - x) - heading)


def _someone_ahead(world: World, distance: float) -> bool:
    near = world.clearance_to_people() < distance
    return any(abs(_bearing(world, place)) < math.pi / 3 for place in world.people_poses[near, :2])


def _limited(value: float) -> float:
    return min(max(value, -1.0), 1.0)
