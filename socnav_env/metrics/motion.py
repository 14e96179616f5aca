"""How smoothly the robot moved."""

from __future__ import annotations

import numpy as np

from reward_model.base.angles import wrap_angles
from reward_model.base.arrays import FloatArray
from socnav_env.metrics.statistics import extreme, mean
from socnav_env.trajectories.trajectory import Trajectory

STILL_SPEED = 0.01  # m/s; HuNavSim
STILL_TURN_RATE = 0.02  # rad/s; HuNavSim


def mean_speed(trajectory: Trajectory) -> float:
    """[m/s], on average over the steps (HuNavSim)."""
    return mean(trajectory.speeds)


def max_speed(trajectory: Trajectory) -> float:
    """[m/s] of the fastest step (HuNavSim)."""
    return extreme(np.max, trajectory.speeds)


def mean_acceleration(trajectory: Trajectory) -> float:
    """[m/s^2] by which the velocity over ground, speed or direction, changes from step to step (HuNavSim)."""
    return mean(_sizes(_accelerations(trajectory)))


def max_acceleration(trajectory: Trajectory) -> float:
    """[m/s^2] of the sharpest change of velocity, see `mean_acceleration` (HuNavSim)."""
    return extreme(np.max, _sizes(_accelerations(trajectory)))


def mean_jerk(trajectory: Trajectory) -> float:
    """[m/s^3] by which the acceleration, a vector, changes from step to step, on average (SocNavBench)."""
    return mean(_sizes(_jerks(trajectory)))


def max_jerk(trajectory: Trajectory) -> float:
    """[m/s^3] of the sharpest change of acceleration (SocNavBench)."""
    return extreme(np.max, _sizes(_jerks(trajectory)))


def heading_change(trajectory: Trajectory) -> float:
    """[rad] that the robot has turned, to the left and to the right added up (HuNavSim)."""
    return float(np.abs(wrap_angles(np.diff(trajectory.robot_poses[:, 2]))).sum())


def path_irregularity(trajectory: Trajectory) -> float:
    """[rad] between the robot's heading and the direction to the goal, on average over the steps (SocNavBench)."""
    poses = trajectory.robot_poses[1:]
    offsets = trajectory.layout.goal - poses[:, :2]
    return mean(np.abs(wrap_angles(np.arctan2(offsets[:, 1], offsets[:, 0]) - poses[:, 2])))


def time_not_moving(trajectory: Trajectory) -> float:
    """[s] slower than 0.01 m/s and 0.02 rad/s (HuNavSim)."""
    turn_rates = np.abs(trajectory.robot_velocities[1:, 2])
    still = (trajectory.speeds < STILL_SPEED) & (turn_rates < STILL_TURN_RATE)
    return float(np.dot(still, trajectory.durations))


def failure_to_progress(trajectory: Trajectory) -> float:
    """Number of steps in which the distance to go does not shrink (SocNavGym)."""
    return float(np.count_nonzero(np.diff(trajectory.goal_distances) >= 0))


def _accelerations(trajectory: Trajectory) -> FloatArray:
    """(n, 2), NaN where the velocity before is not known."""
    return np.diff(trajectory.robot_velocities[:, :2], axis=0) / trajectory.durations[:, None]


def _jerks(trajectory: Trajectory) -> FloatArray:
    """(n - 1, 2), NaN likewise."""
    return np.diff(_accelerations(trajectory), axis=0) / trajectory.durations[1:, None]


def _sizes(vectors: FloatArray) -> FloatArray:
    """Lengths of those vectors that are known."""
    sizes = np.hypot(vectors[:, 0], vectors[:, 1])
    return sizes[~np.isnan(sizes)]
