"""From actions, shares of the robot's top speeds, to commands in SI units, and back.

A command is (3,) forward speed [m/s], speed to the left [m/s] and turn rate [rad/s], whatever the robot's drive; that
of a differential one never goes to the left.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, Protocol

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from reward_model.base.arrays import FloatArray
from reward_model.base.numba import njit
from socnav_env.config.robot import FORWARD, LEFT, TURN, RobotConfig

_NUMBER_WORDS: Final = {2: "two", 3: "three"}


class ActionRule(Protocol):
    """The meaning of a drive's actions."""

    def commands(self, actions: FloatArray, robot: RobotConfig) -> FloatArray:
        """The commands (n, 3) of actions (n, num_axes), which are cut off at -1 and 1."""
        ...

    def action(self, command: FloatArray, robot: RobotConfig) -> list[float]:
        """The action that asks for a command (3,)."""
        ...


class VelocityShares:
    """Each number of an action is a share of a top speed: forward, to the left where the robot can, and turning.

    Forward and left together are no longer than 1.
    """

    def commands(self, actions: FloatArray, robot: RobotConfig) -> FloatArray:
        """See `ActionRule`."""
        forwards, backwards = float(robot.max_forward_speed), float(robot.max_backward_speed)
        return _scaled(actions, forwards, backwards, float(robot.max_sideways_speed), float(robot.max_turn_rate))

    def action(self, command: FloatArray, robot: RobotConfig) -> list[float]:
        """See `ActionRule`."""
        forward, left, turn = command.tolist()
        top_speed = robot.max_forward_speed if forward >= 0 else robot.max_backward_speed
        shares = {
            FORWARD: _share(forward, top_speed),
            LEFT: _share(left, robot.max_sideways_speed),
            TURN: turn / robot.max_turn_rate,
        }
        return [shares[axis] for axis in robot.drive_type.axes]


ACTION_RULES: Final[Mapping[str, ActionRule]] = MappingProxyType(
    {"differential": VelocityShares(), "holonomic": VelocityShares()}
)
"""The rule of each drive, by its name in `DRIVES`."""


def action_space(robot: RobotConfig) -> spaces.Space[NDArray[np.float32]]:
    """The box of actions, one number from -1 to 1 for each axis of the drive."""
    return spaces.Box(-1.0, 1.0, (len(robot.drive_type.axes),), np.float32)


def command_of(action: ArrayLike, robot: RobotConfig) -> FloatArray:
    """The command (3,) of an action; numbers outside the box are cut off.

    Raises:
        ValueError: For an action that is not as many finite numbers as the drive has axes.
    """
    values = np.asarray(action, dtype=np.float64)
    size = len(robot.drive_type.axes)
    if values.shape != (size,) or not all(map(math.isfinite, values.tolist())):
        raise ValueError(refusal_of(values, robot))
    command: FloatArray = scaled(values.reshape(1, size), robot)[0]
    return command


def refusal_of(action: FloatArray, robot: RobotConfig) -> str:
    """The complaint about an action that is not as many finite numbers as the drive has axes."""
    axes = robot.drive_type.axes
    number = _NUMBER_WORDS.get(len(axes), len(axes))
    return f"action must be {number} finite numbers ({', '.join(axes)}), got {np.array2string(action, threshold=6)}"


def scaled(actions: FloatArray, robot: RobotConfig) -> FloatArray:
    """The commands (n, 3) of many actions, (n, num_axes) finite numbers."""
    return ACTION_RULES[robot.drive].commands(actions, robot)


def action_of(command: FloatArray, robot: RobotConfig) -> FloatArray:
    """The action, (num_axes,), that asks for a command."""
    return np.array(ACTION_RULES[robot.drive].action(command, robot))


@njit
def _scaled(actions: FloatArray, forwards: float, backwards: float, sideways: float, turning: float) -> FloatArray:
    commands = np.zeros((len(actions), 3))
    for index in range(len(actions)):
        shares = np.minimum(np.maximum(actions[index], -1.0), 1.0)
        forward, left, turn = shares[0], shares[1] if len(shares) == 3 else 0.0, shares[-1]
        length = max(math.hypot(forward, left), 1.0)
        commands[index, 0] = forward / length * (forwards if forward >= 0 else backwards)
        commands[index, 1] = left / length * sideways
        commands[index, 2] = turn * turning
    return commands


def _share(speed: float, top_speed: float) -> float:
    return speed / top_speed if top_speed else 0.0
