"""What a robot does of what it is told: limited acceleration, and noise."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from reward_model.base.arrays import FloatArray
from reward_model.base.numba import njit
from socnav_env.config.robot import FORWARD, LEFT, MOST_NOISE, TURN, RobotConfig

Velocity = tuple[float, float, float]  # forward [m/s], to the left [m/s], turn rate [rad/s]


class Motion(NamedTuple):
    """What a robot is doing, for compiled code; velocities are forward, to the left, and turning.

    Attributes:
        wanted: (3,) velocity that the robot is to take up
        velocity: (3,) that it has
        limits: (2,) of the acceleration [m/s^2] and of the turn rate's [rad/s^2], infinite where there is none
    """

    wanted: FloatArray
    velocity: FloatArray
    limits: FloatArray


class Motors:
    """Turn commands into velocities in the robot's frame.

    Without limits and noise, which is the default, the velocity is the command. Random numbers are drawn only where
    there is noise, as many in every control period.
    """

    def __init__(self, robot: RobotConfig) -> None:
        self._robot = robot
        self._noisy = robot.speed_noise > 0 or robot.turn_noise > 0
        limits = [math.inf if each is None else each for each in (robot.max_acceleration, robot.max_turn_acceleration)]
        self.motion = Motion(np.zeros(3), np.zeros(3), np.array(limits, dtype=np.float64))

    def command(self, command: FloatArray, rng: np.random.Generator) -> None:
        """Take a command for the control period to come."""
        self.motion.wanted[:] = self._disturbed(command, rng) if self._noisy else command

    def resume(self, velocity: FloatArray) -> None:
        """Go on from a velocity that the robot has reached by itself."""
        self.motion.velocity[:] = velocity

    def _disturbed(self, command: FloatArray, rng: np.random.Generator) -> Velocity:
        """The command with noise in proportion to how hard the robot is driven."""
        robot, (forward, left, turn) = self._robot, map(float, command)
        effort = min(1.0, max(math.hypot(forward, left) / robot.top_speed, abs(turn) / robot.max_turn_rate))
        moves = robot.drive_type.moves
        draws = np.clip(rng.standard_normal(len(moves)), -MOST_NOISE, MOST_NOISE)
        errors = dict(zip(moves, (effort * draws).tolist(), strict=True))
        return (
            forward + robot.speed_noise * errors.get(FORWARD, 0.0),
            left + robot.speed_noise * errors.get(LEFT, 0.0),
            turn + robot.turn_noise * errors.get(TURN, 0.0),
        )


@njit
def approach(motion: Motion, duration: float) -> None:
    """Bring the velocity as close to the wanted one as the limits allow within a duration [s]."""
    limits, velocity, wanted = motion.limits, motion.velocity, motion.wanted
    if math.isinf(limits[0]) and math.isinf(limits[1]):
        velocity[:] = wanted
        return
    change = wanted - velocity
    linear = _allowed(math.hypot(change[0], change[1]), limits[0] * duration)
    angular = _allowed(abs(change[2]), limits[1] * duration)
    velocity[0] += linear * change[0]
    velocity[1] += linear * change[1]
    velocity[2] += angular * change[2]


@njit
def _allowed(change: float, limit: float) -> float:
    """The share of a change of velocity that happens."""
    return 1.0 if change <= limit else limit / change
