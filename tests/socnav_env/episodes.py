"""Recorded episodes whose every number a test sets by hand."""

from __future__ import annotations

import numpy as np

from reward_model.base.arrays import FloatArray
from socnav_env.trajectories.outcomes import Outcome
from socnav_env.trajectories.trajectory import Trajectory
from tests.socnav_env.puppets import make_layout


def make_trajectory(
    robot: FloatArray, people: FloatArray | None = None, outcome: Outcome | None = Outcome.ARRIVED, **changes
) -> Trajectory:
    """An episode in steps of 0.2 s of a robot 0.25 m in radius among people as wide.

    robot: (n + 1, 2 or 3) x, y and heading, 0 where it is left out
    people: (n + 1, num_people, 2) places, or (num_people, 2) for people who stay there; nobody where left out
    """
    robot = np.asarray(robot, dtype=np.float64)
    rows = len(robot)
    people = np.zeros((0, 2)) if people is None else np.asarray(people, dtype=np.float64)
    people = np.broadcast_to(people, (rows, *people.shape[-2:]))
    poses = np.zeros((rows, people.shape[1], 3))
    poses[..., :2] = people
    robot_poses = np.zeros((rows, 3))
    robot_poses[:, : robot.shape[1]] = robot
    values = {
        "layout": make_layout(
            people_poses=poses[0], interaction_pairs=np.zeros((0, 2), dtype=np.int64), interaction_relations=()
        ),
        "times": 0.2 * np.arange(rows),
        "robot_radius": 0.25,
        "people_radius": 0.25,
        "top_speed": 0.5,
        "robot_poses": robot_poses,
        "robot_velocities": np.vstack([np.zeros((1, 3)), np.diff(robot_poses, axis=0) / 0.2]),
        "people_poses": poses,
        "people_velocities": np.concatenate([np.zeros((1, poses.shape[1], 3)), np.diff(poses, axis=0) / 0.2]),
        "people_targets": poses[..., :2].copy(),
        "commands": np.zeros((rows - 1, 3)),
        "scores": np.full((rows - 1, 2), np.nan),
        "outcome": outcome,
    }
    return Trajectory(**{**values, **changes})
