"""From actions, shares of the robot's top speeds, to commands in SI units, and back.

A command is (3,) forward speed [m/s], speed to the left [m/s] and turn rate [rad/s], whatever the robot's drive; a
differential one is never told to drive to the left.
"""

from __future__ import annotations

import math

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from reward_model.base.arrays import FloatArray
from reward_model.base.numba import njit
from socnav_env.config.robot import RobotConfig


def action_space(robot: RobotConfig) -> spaces.Space[NDArray[np.float32]]:
    """Return the box of actions: forward and turn, or forward, left and turn for a holonomic robot."""
    return spaces.Box(-1.0, 1.0, (3,) if robot.is_holonomic else (2,), np.float32)


def command_of(action: ArrayLike, robot: RobotConfig) -> FloatArray:
    """Translate an action into a command.

    Values outside the box are clipped to it; forward and left together are then no longer than 1.
    Raises `ValueError` for an action that is not as many finite numbers as the robot takes.
    """
    values = np.asarray(action, dtype=np.float64)
    size = 3 if robot.is_holonomic else 2
    if values.shape != (size,) or not all(map(math.isfinite, values.tolist())):
        raise ValueError(refusal_of(values, robot))
    command: FloatArray = scaled(values.reshape(1, size), robot)[0]
    return command


def refusal_of(action: FloatArray, robot: RobotConfig) -> str:
    """Say what is wrong with an action that is not as many finite numbers as the robot takes."""
    rule = "three finite numbers (forward, left, turn)" if robot.is_holonomic else "two finite numbers (forward, turn)"
    return f"action must be {rule}, got {np.array2string(action, threshold=6)}"


def scaled(actions: FloatArray, robot: RobotConfig) -> FloatArray:
    """Translate many actions, (n, 2) or (n, 3) finite numbers, into commands, (n, 3), as `command_of` does one."""
    forwards, backwards = float(robot.max_forward_speed), float(robot.max_backward_speed)
    return _scaled(actions, forwards, backwards, float(robot.max_sideways_speed), float(robot.max_turn_rate))


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


def action_of(command: FloatArray, robot: RobotConfig) -> FloatArray:
    """Translate a command into the action, (2,) or (3,), that asks for it."""
    forward, left, turn = command.tolist()
    top_speed = robot.max_forward_speed if forward >= 0 else robot.max_backward_speed
    shares = [_share(forward, top_speed), _share(left, robot.max_sideways_speed), turn / robot.max_turn_rate]
    return np.array(shares if robot.is_holonomic else shares[::2])


def _share(speed: float, top_speed: float) -> float:
    return speed / top_speed if top_speed else 0.0
