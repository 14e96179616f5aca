"""What a robot does of what it is told: limited acceleration, and noise."""

from __future__ import annotations

import math

import numpy as np

from socnav_env.robot_config import MOST_NOISE, RobotConfig

Velocity = tuple[float, float, float]  # forward [m/s], to the left [m/s], turn rate [rad/s]
STANDING: Velocity = (0.0, 0.0, 0.0)


class Motors:
    """Turn commands into velocities in the robot's frame.

    Without limits and noise, which is the default, the velocity is the command. Random numbers are drawn only where
    there is noise, as many in every control period.
    """

    def __init__(self, robot: RobotConfig) -> None:
        self._robot = robot
        self._noisy = robot.speed_noise > 0 or robot.turn_noise > 0
        self._limited = robot.max_acceleration is not None or robot.max_turn_acceleration is not None
        self._wanted, self._velocity = STANDING, STANDING

    def command(self, command: Velocity, rng: np.random.Generator) -> None:
        """Take a command for the control period to come."""
        self._wanted = self._disturbed(command, rng) if self._noisy else command

    def velocity(self, duration: float) -> Velocity:
        """What the robot does for the next `duration` [s]."""
        self._velocity = self._approached(duration) if self._limited else self._wanted
        return self._velocity

    def resume(self, velocity: Velocity) -> None:
        """Go on from a velocity that the robot has reached by itself."""
        self._velocity = velocity

    def stop(self) -> None:
        """Stand at once: the robot has touched something."""
        self.resume(STANDING)

    def _disturbed(self, command: Velocity, rng: np.random.Generator) -> Velocity:
        """The command with noise in proportion to how hard the robot is driven."""
        robot, (forward, left, turn) = self._robot, command
        effort = min(1.0, max(math.hypot(forward, left) / robot.top_speed, abs(turn) / robot.max_turn_rate))
        draws = np.clip(rng.standard_normal(3 if robot.is_holonomic else 2), -MOST_NOISE, MOST_NOISE)
        errors = (effort * draws).tolist()
        if robot.is_holonomic:
            left += robot.speed_noise * errors[1]
        return forward + robot.speed_noise * errors[0], left, turn + robot.turn_noise * errors[-1]

    def _approached(self, duration: float) -> Velocity:
        """The last velocity, brought as close to the wanted one as acceleration allows."""
        forward, left, turn = self._velocity
        d_forward, d_left, d_turn = (want - have for want, have in zip(self._wanted, self._velocity, strict=True))
        linear = _allowed(math.hypot(d_forward, d_left), self._robot.max_acceleration, duration)
        angular = _allowed(abs(d_turn), self._robot.max_turn_acceleration, duration)
        return forward + linear * d_forward, left + linear * d_left, turn + angular * d_turn


def _allowed(change: float, limit: float | None, duration: float) -> float:
    """The share of a change of velocity that happens within a duration [s]."""
    if limit is None or change <= limit * duration:
        return 1.0
    return limit * duration / change
