"""Delay and detour of people because of the robot: an episode compared with the same one without the robot.

The two are compared walk by walk. A walk is a person's path to one target. It counts as long as the person has had
the same targets in both episodes, since after that they walk elsewhere. If a walk is broken off in one episode, both
are measured up to the smallest distance to the target that both reach. A detour is the length of a path [m] beyond
the distance by which it comes closer to the target.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from reward_model.base.arrays import FloatArray
from socnav_env.metrics.statistics import mean
from socnav_env.trajectories.trajectory import Trajectory


def person_detour(trajectory: Trajectory, without_robot: Trajectory | None = None) -> float:
    """[m] extra length of a walking person's path compared with no robot, on average (Francis et al.).

    Args:
        without_robot: the same episode without the robot, see `socnav_env.recording.replay.rerun_without_robot`; NaN if
            there is none, or if nobody walks
    """
    return _mean_difference(trajectory, without_robot, 1)


def person_delay(trajectory: Trajectory, without_robot: Trajectory | None = None) -> float:
    """[s] extra time of a walking person compared with no robot, on average (Francis et al.).

    Args:
        without_robot: as in `person_detour`
    """
    return _mean_difference(trajectory, without_robot, 0)


def _mean_difference(trajectory: Trajectory, without_robot: Trajectory | None, column: int) -> float:
    """Mean over those who walk; column 0: time, 1: detour."""
    if without_robot is None:
        return np.nan
    differences = []
    for person in np.flatnonzero(trajectory.layout.people_walk).tolist():
        walks = list(zip(_walks(trajectory, person), _walks(without_robot, person), strict=False))
        same = next((i for i, (one, other) in enumerate(walks) if not _same_target(one, other)), len(walks))
        if same:
            differences.append(sum(_difference(one, other)[column] for one, other in walks[:same]))
    return mean(np.array(differences))


class _Walk:
    """A person's path to one target.

    rows: (num_rows, 3) time [s], smallest distance to the target so far [m], and the sum of that distance and the
        path walked since the episode began [m], which grows with every metre that leads no closer
    """

    def __init__(self, trajectory: Trajectory, person: int, start: int, end: int, path: FloatArray) -> None:
        self.target = trajectory.people_targets[end, person]
        offsets = trajectory.people_poses[start : end + 1, person, :2] - self.target
        distances = np.minimum.accumulate(np.hypot(offsets[:, 0], offsets[:, 1]))
        times = trajectory.times[start : end + 1]
        self.rows = np.column_stack([times, distances, path[start : end + 1] + distances])

    def taken_to(self, distance: float) -> FloatArray:
        """(2,) time [s] and detour [m] from the start of the walk until its target is `distance` [m] away."""
        reached = int(np.argmax(self.rows[:, 1] <= distance))
        row = self.rows[reached]
        if reached:
            before = self.rows[reached - 1]
            row = row + (before - row) * (distance - row[1]) / (before[1] - row[1])
        return np.asarray((row - self.rows[0])[[0, 2]])


def _walks(trajectory: Trajectory, person: int) -> list[_Walk]:
    """The walks of a person; targets[k] is the target of step k, so a walk begins in the row before its first step."""
    targets = trajectory.people_targets[1:, person]
    places = trajectory.people_poses[:, person, :2]
    path = np.concatenate([[0.0], np.hypot(*np.diff(places, axis=0).T).cumsum()])
    changes = np.flatnonzero((targets[1:] != targets[:-1]).any(axis=1)) + 1
    borders = [0, *changes.tolist(), len(targets)]
    return [_Walk(trajectory, person, start, end, path) for start, end in pairwise(borders) if end > start]


def _same_target(one: _Walk, other: _Walk) -> bool:
    return bool(np.array_equal(one.target, other.target))


def _difference(one: _Walk, other: _Walk) -> FloatArray:
    """(2,) time [s] and detour [m] by which one walk is longer than another one to the same target."""
    distance = float(max(one.rows[-1, 1], other.rows[-1, 1]))
    return np.asarray(one.taken_to(distance) - other.taken_to(distance))
