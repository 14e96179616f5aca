"""Measures of a recorded episode, each a pure function of a `Trajectory`.

Sources stand in each function. "Distance" is between surfaces (centre distance minus both radii) unless a function
says centre. A step is judged by the state it led to, so that an episode of n steps has n values; the start, row 0,
counts only where something changes from it. A measure that has no meaning in an episode (the distance to people
in a room without any, the time to the goal where it was not reached) is NaN.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from socnav_env.layout import BoolArray, FloatArray
from socnav_env.outcomes import Outcome
from socnav_env.trajectory import Trajectory

INTIMATE_DISTANCE = 0.45  # m, centre; Hall 1966
PERSONAL_DISTANCE = 1.2  # m, centre; Hall 1966
SOCIAL_DISTANCE = 3.6  # m, centre; Hall 1966
DISCOMFORT_DISTANCE = 0.2  # m; CrowdNav
STILL_SPEED = 0.01  # m/s; HuNavSim
STILL_TURN_RATE = 0.02  # rad/s; HuNavSim
ACCEPTABLE_SCORE = 0.4  # what raters were told to give where a robot is just acceptable


def success(trajectory: Trajectory) -> float:
    """1 if the robot arrived in time without touching anything, else 0 (Francis et al. 2023)."""
    return float(trajectory.outcome is Outcome.ARRIVED)


def timeout(trajectory: Trajectory) -> float:
    """1 if the robot ran out of time, else 0 (Francis et al. 2023)."""
    return float(trajectory.outcome is Outcome.TIMEOUT)


def collision_person(trajectory: Trajectory) -> float:
    """1 if the episode ended by touching a person, else 0 (Francis et al. 2023)."""
    return float(trajectory.outcome is Outcome.COLLISION_PERSON)


def collision_object(trajectory: Trajectory) -> float:
    """1 if the episode ended by touching an object, else 0 (Francis et al. 2023)."""
    return float(trajectory.outcome is Outcome.COLLISION_OBJECT)


def collision_wall(trajectory: Trajectory) -> float:
    """1 if the episode ended by touching a wall, else 0 (Francis et al. 2023)."""
    return float(trajectory.outcome is Outcome.COLLISION_WALL)


def time_to_goal(trajectory: Trajectory) -> float:
    """[s] of an episode that succeeded (CrowdNav)."""
    return len(trajectory) * trajectory.control_period if success(trajectory) else np.nan


def path_length(trajectory: Trajectory) -> float:
    """[m] driven in an episode that succeeded (CrowdNav)."""
    if not success(trajectory):
        return np.nan
    moves = np.diff(trajectory.robot_poses[:, :2], axis=0)
    return float(np.hypot(moves[:, 0], moves[:, 1]).sum())


def min_person_distance(trajectory: Trajectory) -> float:
    """[m] to the closest person at the closest moment (HuNavSim)."""
    return _finite(np.min(trajectory.person_clearances, initial=np.inf))


def mean_min_person_distance(trajectory: Trajectory) -> float:
    """[m] to the closest person of each step, on average (HuNavSim)."""
    return _finite(_mean(trajectory.person_clearances))


def intimate_zone(trajectory: Trajectory) -> float:
    """[% of time] with a person within 0.45 m, centre (Hall 1966)."""
    return _percentage(trajectory.person_distances <= INTIMATE_DISTANCE)


def personal_zone(trajectory: Trajectory) -> float:
    """[% of time] with a person within 1.2 m, centre, the intimate zone included (Hall 1966)."""
    return _percentage(trajectory.person_distances <= PERSONAL_DISTANCE)


def social_zone(trajectory: Trajectory) -> float:
    """[% of time] with a person within 3.6 m, centre, both closer zones included (Hall 1966)."""
    return _percentage(trajectory.person_distances <= SOCIAL_DISTANCE)


def discomfort_rate(trajectory: Trajectory) -> float:
    """Share of steps with a person within 0.2 m (CrowdNav)."""
    return _mean(trajectory.person_clearances < DISCOMFORT_DISTANCE)


def discomfort_distance(trajectory: Trajectory) -> float:
    """[m] to the closest person, on average over the steps with one within 0.2 m (CrowdNav)."""
    clearances = trajectory.person_clearances
    return _mean(clearances[clearances < DISCOMFORT_DISTANCE])


def mean_speed(trajectory: Trajectory) -> float:
    """[m/s], on average over the steps (HuNavSim)."""
    return _mean(trajectory.speeds)


def max_speed(trajectory: Trajectory) -> float:
    """[m/s] of the fastest step (HuNavSim)."""
    return _extreme(np.max, trajectory.speeds)


def time_not_moving(trajectory: Trajectory) -> float:
    """[s] slower than 0.01 m/s and 0.02 rad/s (HuNavSim)."""
    turn_rates = np.abs(trajectory.robot_velocities[1:, 2])
    still = (trajectory.speeds < STILL_SPEED) & (turn_rates < STILL_TURN_RATE)
    return float(np.count_nonzero(still)) * trajectory.control_period


def failure_to_progress(trajectory: Trajectory) -> float:
    """Number of steps in which the distance to go does not shrink (SocNavGym)."""
    return float(np.count_nonzero(np.diff(trajectory.goal_distances) >= 0))


def q1_mean(trajectory: Trajectory) -> float:
    """Learned Q1, on average over the steps."""
    return _mean(trajectory.scores[:, 0])


def q1_minimum(trajectory: Trajectory) -> float:
    """Learned Q1 of the worst step."""
    return _extreme(np.min, trajectory.scores[:, 0])


def q1_share_below_acceptable(trajectory: Trajectory) -> float:
    """Share of steps with a learned Q1 below 0.4."""
    return _share_below_acceptable(trajectory.scores[:, 0])


def q2_mean(trajectory: Trajectory) -> float:
    """Learned Q2, on average over the steps."""
    return _mean(trajectory.scores[:, 1])


def q2_minimum(trajectory: Trajectory) -> float:
    """Learned Q2 of the worst step."""
    return _extreme(np.min, trajectory.scores[:, 1])


def q2_share_below_acceptable(trajectory: Trajectory) -> float:
    """Share of steps with a learned Q2 below 0.4."""
    return _share_below_acceptable(trajectory.scores[:, 1])


METRICS: dict[str, Callable[[Trajectory], float]] = {
    metric.__name__: metric
    for metric in (
        success,
        timeout,
        collision_person,
        collision_object,
        collision_wall,
        time_to_goal,
        path_length,
        min_person_distance,
        mean_min_person_distance,
        intimate_zone,
        personal_zone,
        social_zone,
        discomfort_rate,
        discomfort_distance,
        mean_speed,
        max_speed,
        time_not_moving,
        failure_to_progress,
        q1_mean,
        q1_minimum,
        q1_share_below_acceptable,
        q2_mean,
        q2_minimum,
        q2_share_below_acceptable,
    )
}


def episode_metrics(trajectory: Trajectory) -> dict[str, float]:
    """Every measure of an episode, by its name."""
    return {name: metric(trajectory) for name, metric in METRICS.items()}


def _mean(values: FloatArray | BoolArray) -> float:
    return float(np.mean(values)) if len(values) else np.nan


def _extreme(choose: Callable[[FloatArray], np.floating], values: FloatArray) -> float:
    return float(choose(values)) if len(values) else np.nan


def _percentage(flags: BoolArray) -> float:
    return 100.0 * _mean(flags)


def _finite(value: float | np.floating) -> float:
    """NaN for the infinite distance to nobody."""
    return float(value) if np.isfinite(value) else np.nan


def _share_below_acceptable(scores: FloatArray) -> float:
    """Unjudged steps make the share unknown, not small."""
    return np.nan if np.isnan(scores).any() else _mean(scores < ACCEPTABLE_SCORE)
