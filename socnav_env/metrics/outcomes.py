"""Measures of the outcome, the duration and the path of an episode."""

from __future__ import annotations

import numpy as np

from socnav_env.geometry.shortest_path import edges_of, shortest_path_length
from socnav_env.metrics.statistics import finite
from socnav_env.trajectories.outcomes import Outcome
from socnav_env.trajectories.trajectory import Trajectory


def success(trajectory: Trajectory) -> float:
    """1 if the robot arrived in time without touching anything, else 0 (Francis et al. 2023)."""
    return _ended(trajectory, Outcome.ARRIVED)


def timeout(trajectory: Trajectory) -> float:
    """1 if the robot ran out of time, else 0 (Francis et al. 2023)."""
    return _ended(trajectory, Outcome.TIMEOUT)


def collision_person(trajectory: Trajectory) -> float:
    """1 if the episode ended by touching a person, else 0 (Francis et al. 2023)."""
    return _ended(trajectory, Outcome.COLLISION_PERSON)


def collision_object(trajectory: Trajectory) -> float:
    """1 if the episode ended by touching an object, else 0 (Francis et al. 2023)."""
    return _ended(trajectory, Outcome.COLLISION_OBJECT)


def collision_wall(trajectory: Trajectory) -> float:
    """1 if the episode ended by touching a wall, else 0 (Francis et al. 2023)."""
    return _ended(trajectory, Outcome.COLLISION_WALL)


def time_to_goal(trajectory: Trajectory) -> float:
    """[s] duration of a successful episode (CrowdNav)."""
    return _duration(trajectory) if trajectory.outcome is Outcome.ARRIVED else np.nan


def path_length(trajectory: Trajectory) -> float:
    """[m] driven in a successful episode (CrowdNav)."""
    return _driven(trajectory) if trajectory.outcome is Outcome.ARRIVED else np.nan


def spl(trajectory: Trajectory) -> float:
    """Success weighted by path length, S * L / max(P, L), 0..1 (Anderson et al. 2018, eq. 1).

    P is the length driven and L the length of the shortest path from the start to the goal on which the robot touches
    no wall and no object, see `shortest_way`. The measure is NaN if there is no such path, and 0 if the robot did not
    succeed.
    """
    if trajectory.outcome is not Outcome.ARRIVED:
        return success(trajectory)
    shortest = shortest_way(trajectory)
    return shortest / max(_driven(trajectory), shortest)


def stl(trajectory: Trajectory) -> float:
    """Success weighted by time, S * T* / max(T, T*), 0..1 (Francis et al. 2023).

    T is the time taken and T* the length of the shortest path, as in `spl`, divided by the robot's top speed.
    """
    if trajectory.outcome is not Outcome.ARRIVED:
        return success(trajectory)
    shortest = shortest_way(trajectory) / trajectory.top_speed
    return shortest / max(_duration(trajectory), shortest)


def shortest_way(trajectory: Trajectory) -> float:
    """[m] shortest path from the start to the goal's centre past walls and objects; NaN if there is no path.

    People are not part of the static map, not even those who stand.
    """
    layout, start = trajectory.layout, trajectory.robot_poses[0, :2]
    return finite(shortest_path_length(start, layout.goal, trajectory.robot_radius, edges_of(layout)))


def _ended(trajectory: Trajectory, outcome: Outcome) -> float:
    return np.nan if trajectory.outcome is None else float(trajectory.outcome is outcome)


def _duration(trajectory: Trajectory) -> float:
    return float(trajectory.times[-1] - trajectory.times[0])


def _driven(trajectory: Trajectory) -> float:
    moves = np.diff(trajectory.robot_poses[:, :2], axis=0)
    return float(np.hypot(moves[:, 0], moves[:, 1]).sum())
