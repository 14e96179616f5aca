"""Measures of the robot's behaviour towards people."""

from __future__ import annotations

import numpy as np

from reward_model.base.arrays import BoolArray
from socnav_env.metrics.statistics import finite, mean, share_of_time
from socnav_env.trajectories.trajectory import Trajectory

INTIMATE_DISTANCE = 0.45  # m, centre; Hall 1966
PERSONAL_DISTANCE = 1.2  # m, centre; Hall 1966
SOCIAL_DISTANCE = 3.6  # m, centre; Hall 1966
DISCOMFORT_DISTANCE = 0.2  # m; CrowdNav
LOOK_AHEAD = 1.0  # s, of a person's path that the robot should stay out of


def min_person_distance(trajectory: Trajectory) -> float:
    """[m] minimum distance to a person (HuNavSim)."""
    return finite(np.min(trajectory.person_clearances, initial=np.inf))


def mean_min_person_distance(trajectory: Trajectory) -> float:
    """[m] distance to the closest person, on average over the steps (HuNavSim)."""
    return finite(mean(trajectory.person_clearances))


def intimate_zone(trajectory: Trajectory) -> float:
    """[% of time] with a person within 0.45 m, centre (Hall 1966)."""
    return share_of_time(trajectory.person_distances <= INTIMATE_DISTANCE, trajectory.durations)


def personal_zone(trajectory: Trajectory) -> float:
    """[% of time] with a person within 1.2 m, centre, the intimate zone included (Hall 1966)."""
    return share_of_time(trajectory.person_distances <= PERSONAL_DISTANCE, trajectory.durations)


def social_zone(trajectory: Trajectory) -> float:
    """[% of time] with a person within 3.6 m, centre, both closer zones included (Hall 1966)."""
    return share_of_time(trajectory.person_distances <= SOCIAL_DISTANCE, trajectory.durations)


def discomfort_rate(trajectory: Trajectory) -> float:
    """Share of steps with a person within 0.2 m (CrowdNav)."""
    return mean(trajectory.person_clearances < DISCOMFORT_DISTANCE)


def discomfort_distance(trajectory: Trajectory) -> float:
    """[m] distance to the closest person, on average over the steps with one within 0.2 m (CrowdNav)."""
    clearances = trajectory.person_clearances
    return mean(clearances[clearances < DISCOMFORT_DISTANCE])


def intrusion_ratio(trajectory: Trajectory) -> float:
    """Share of steps in which the robot is in a person's way (CrowdNav++, Liu et al. 2023).

    The robot is in the way if its body overlaps the area that the person's body sweeps in the next second at
    constant velocity.
    """
    return mean(_in_the_way(trajectory))


def intrusion_distance(trajectory: Trajectory) -> float:
    """[m] distance to the closest person, on average over the steps of `intrusion_ratio` (CrowdNav++)."""
    return mean(trajectory.person_clearances[_in_the_way(trajectory)])


def min_time_to_collision(trajectory: Trajectory) -> float:
    """[s] minimum time until the robot and a person would touch at constant velocity (Francis et al. 2023).

    Velocities are over ground. NaN if they were never on a collision course.
    """
    offsets = trajectory.people_poses[1:, :, :2] - trajectory.robot_poses[1:, None, :2]
    moves = trajectory.people_velocities[1:, :, :2] - trajectory.robot_velocities[1:, None, :2]
    # |offset + t move| = both radii, a quadratic equation in the time t whose smaller root is the first touch.
    gap = (offsets**2).sum(axis=2) - _bodies(trajectory) ** 2
    closing = -(offsets * moves).sum(axis=2)
    discriminant = closing**2 - (moves**2).sum(axis=2) * gap
    collides = (closing > 0) & (discriminant >= 0) & (gap > 0)
    touch = gap[collides] / (closing[collides] + np.sqrt(discriminant[collides]))
    touching = 0.0 if (gap <= 0).any() else np.inf
    return finite(np.min(touch, initial=touching))


def _bodies(trajectory: Trajectory) -> float:
    return trajectory.robot_radius + trajectory.people_radius


def _in_the_way(trajectory: Trajectory) -> BoolArray:
    """(n,) whether the robot is where a person's body will be in the next second."""
    offsets = trajectory.robot_poses[1:, None, :2] - trajectory.people_poses[1:, :, :2]
    ways = LOOK_AHEAD * trajectory.people_velocities[1:, :, :2]
    squared = (ways**2).sum(axis=2)
    shares = np.clip((offsets * ways).sum(axis=2) / np.where(squared == 0, 1.0, squared), 0.0, 1.0)
    apart = offsets - shares[..., None] * ways
    return np.asarray((np.hypot(apart[..., 0], apart[..., 1]) < _bodies(trajectory)).any(axis=1))
