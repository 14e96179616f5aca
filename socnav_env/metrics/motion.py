"""Measures of how smoothly the robot moved."""

from __future__ import annotations

import numpy as np

from reward_model.base.angles import wrap_angles
from reward_model.base.arrays import FloatArray
from socnav_env.metrics.statistics import extreme, mean
from socnav_env.trajectories.trajectory import Trajectory

STILL_SPEED = 0.01  # m/s; HuNavSim
STILL_TURN_RATE = 0.02  # rad/s; HuNavSim


def mean_speed(trajectory: Trajectory) -> float:
    """[m/s] mean speed over the steps (HuNavSim)."""
    return mean(trajectory.speeds)


def max_speed(trajectory: Trajectory) -> float:
    """[m/s] maximum speed over the steps (HuNavSim)."""
    return extreme(np.max, trajectory.speeds)


def mean_acceleration(trajectory: Trajectory) -> float:
    """[m/s^2] mean change of the velocity over ground, in speed or direction, from step to step (HuNavSim)."""
    return mean(_sizes(_accelerations(trajectory)))


def max_acceleration(trajectory: Trajectory) -> float:
    """[m/s^2] maximum change of the velocity, see `mean_acceleration` (HuNavSim)."""
    return extreme(np.max, _sizes(_accelerations(trajectory)))


def mean_jerk(trajectory: Trajectory) -> float:
    """[m/s^3] mean change of the acceleration, a vector, from step to step (SocNavBench)."""
    return mean(_sizes(_jerks(trajectory)))


def max_jerk(trajectory: Trajectory) -> float:
    """[m/s^3] maximum change of the acceleration (SocNavBench)."""
    return extreme(np.max, _sizes(_jerks(trajectory)))


def heading_change(trajectory: Trajectory) -> float:
    """[rad] total turning of the robot, left and right added up (HuNavSim)."""
    return float(np.abs(wrap_angles(np.diff(trajectory.robot_poses[:, 2]))).sum())


def path_irregularity(trajectory: Trajectory) -> float:
    """[rad] mean angle between the robot's heading and the direction to the goal over the steps (SocNavBench)."""
    poses = trajectory.robot_poses[1:]
    offsets = trajectory.layout.goal - poses[:, :2]
    return mean(np.abs(wrap_angles(np.arctan2(offsets[:, 1], offsets[:, 0]) - poses[:, 2])))


def time_not_moving(trajectory: Trajectory) -> float:
    """[s] time slower than 0.01 m/s and 0.02 rad/s (HuNavSim)."""
    turn_rates = np.abs(trajectory.robot_velocities[1:, 2])
    still = (trajectory.speeds < STILL_SPEED) & (turn_rates < STILL_TURN_RATE)
    return float(np.dot(still, trajectory.durations))


def failure_to_progress(trajectory: Trajectory) -> float:
    """Number of steps in which the distance to the goal does not shrink (SocNavGym)."""
    return float(np.count_nonzero(np.diff(trajectory.goal_distances) >= 0))


def _accelerations(trajectory: Trajectory) -> FloatArray:
    """(n, 2) accelerations [m/s^2], NaN if the velocity before is unknown."""
    return np.diff(trajectory.robot_velocities[:, :2], axis=0) / trajectory.durations[:, None]


def _jerks(trajectory: Trajectory) -> FloatArray:
    """(n - 1, 2) jerks [m/s^3], NaN likewise."""
    return np.diff(_accelerations(trajectory), axis=0) / trajectory.durations[1:, None]


def _sizes(vectors: FloatArray) -> FloatArray:
    """Lengths of the vectors that are known."""
    sizes = np.hypot(vectors[:, 0], vectors[:, 1])
    return sizes[~np.isnan(sizes)]
