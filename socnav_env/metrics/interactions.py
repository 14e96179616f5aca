"""Measures of the robot's behaviour towards people who interact with each other or with objects."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from reward_model.base.arrays import FloatArray
from socnav_env.metrics.statistics import share_of_time
from socnav_env.people.interactions import interactions_at, linked_groups
from socnav_env.trajectories.trajectory import Trajectory

NEAR_INTERACTION = 0.4  # m, between the robot's surface and the line


def interaction_crossings(trajectory: Trajectory) -> float:
    """Number of times the robot's centre crosses the line between two who interact (this project).

    Every interaction counts: two who talk, two who walk together, a person and their object. If a line moves, the
    robot's path relative to the line counts.
    """
    along, beside, lengths = _relative_to_lines(trajectory)
    sides = np.sign(beside)
    for row in np.flatnonzero((sides[1:] == 0).any(axis=1)) + 1:  # a robot on a line has not crossed it yet
        sides[row] = np.where(sides[row] == 0, sides[row - 1], sides[row])
    present = trajectory.interactions.present
    crossed = (sides[:-1] * sides[1:] < 0) & present[:-1] & present[1:]
    before, after = beside[:-1][crossed], beside[1:][crossed]
    shares = before / (before - after)
    places = along[:-1][crossed] * (1 - shares) + along[1:][crossed] * shares
    ends = lengths[:-1][crossed] * (1 - shares) + lengths[1:][crossed] * shares
    return float(np.count_nonzero((places >= 0) & (places <= ends)))


def interaction_time(trajectory: Trajectory) -> float:
    """[s] with the robot's surface within 0.4 m of the line between two who interact (this project)."""
    along, beside, lengths = _relative_to_lines(trajectory)
    beyond = np.maximum(np.maximum(-along, along - lengths), 0.0)
    clearances = np.hypot(beyond, beside)[1:] - trajectory.robot_radius
    near = (clearances <= NEAR_INTERACTION) & trajectory.interactions.present[1:]
    return float(np.dot(near.any(axis=1), trajectory.durations))


def group_intrusion(trajectory: Trajectory) -> float:
    """[% of time] with the robot's centre inside the circle through a standing group (HuNavSim).

    A group is people who stand and are linked by conversations. The circle is centred at their mean position and its
    radius is their mean distance from there: two who talk stand at the ends of its diameter.
    """
    intruding = np.zeros(len(trajectory) + 1, dtype=np.bool_)
    changes = trajectory.interaction_changes
    for begin, end in pairwise([*np.unique([0, *changes[:, 0]]).tolist(), len(intruding)]):
        for members in linked_groups(interactions_at(begin, trajectory.layout, changes)):
            places = trajectory.people_poses[begin:end, members, :2]
            center = places.mean(axis=1)
            radius = _lengths(places - center[:, None]).mean(axis=1)
            intruding[begin:end] |= _lengths(trajectory.robot_poses[begin:end, :2] - center) < radius
    return share_of_time(intruding[1:], trajectory.durations)


def _relative_to_lines(trajectory: Trajectory) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The robot's position relative to each interaction's line, in each row: three times (n + 1, num_interactions).

    Returns:
        The distance along the line from its first end, the distance to its left, and the line's length [m].
    """
    rows = len(trajectory.people_poses)
    objects = np.broadcast_to(trajectory.layout.object_poses[:, :2], (rows, trajectory.layout.num_objects, 2))
    places = np.concatenate([trajectory.people_poses[:, :, :2], objects], axis=1)
    ends = places[:, trajectory.interactions.pairs]
    lines = ends[:, :, 1] - ends[:, :, 0]
    lengths = _lengths(lines)
    directions = lines / np.where(lengths == 0, 1.0, lengths)[..., None]
    offsets = trajectory.robot_poses[:, None, :2] - ends[:, :, 0]
    along = (offsets * directions).sum(axis=2)
    beside = directions[..., 0] * offsets[..., 1] - directions[..., 1] * offsets[..., 0]
    # Two at the same place have no line to cross, but a distance.
    return along, np.where(lengths == 0, _lengths(offsets), beside), lengths


def _lengths(vectors: FloatArray) -> FloatArray:
    return np.hypot(vectors[..., 0], vectors[..., 1])
