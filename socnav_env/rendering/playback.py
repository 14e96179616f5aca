"""Views of any moment of a recorded episode."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from reward_model.base.angles import wrap_angles
from reward_model.base.arrays import FloatArray
from reward_model.graph.windows import select_window
from reward_model.scenes.scene import Scores
from socnav_env.config import EnvConfig
from socnav_env.geometry.frames import lines_between
from socnav_env.rendering.view import SceneView
from socnav_env.simulation.snapshots import frames_per_window
from socnav_env.trajectories.trajectory import Trajectory

ROUNDING: Final = 1e-6  # of a step


def view_at(trajectory: Trajectory, time: float, config: EnvConfig) -> SceneView:
    """The view `time` [s] after an episode's start; between two steps poses are interpolated linearly."""
    steps = min(max(time / config.control_period, 0.0), len(trajectory))
    row = math.floor(steps + ROUNDING)
    view = view_of(trajectory, row, config)
    share = steps - row
    if share <= ROUNDING:
        return view
    robot_pose = _between(trajectory.robot_poses[row], trajectory.robot_poses[row + 1], share)
    people_poses = _between(trajectory.people_poses[row], trajectory.people_poses[row + 1], share)
    return replace(
        view,
        robot_pose=robot_pose,
        people_poses=people_poses,
        interaction_lines=_lines(trajectory, row, people_poses),
        trail=np.vstack([view.trail, robot_pose[:2]]),
        time=steps * config.control_period,
        outcome=None,
    )


def _between(earlier: FloatArray, later: FloatArray, share: float) -> FloatArray:
    """Poses (..., 3) interpolated between two, turning the short way."""
    change = later - earlier
    change[..., 2] = wrap_angles(change[..., 2])
    return np.asarray(earlier + share * change)


def _lines(trajectory: Trajectory, row: int, people_poses: FloatArray) -> FloatArray:
    """Lines between those who interact at a row of the trajectory, with people at `people_poses` (num_people, 3)."""
    history = trajectory.interactions
    return lines_between(history.pairs[history.present[row]], people_poses, trajectory.layout.object_poses)


def view_of(trajectory: Trajectory, row: int, config: EnvConfig) -> SceneView:
    """The view of an episode after `row` steps, with a trail of the last two seconds and marks at the scored frames."""
    layout, people_poses = trajectory.layout, trajectory.people_poses[row]
    first = max(row + 1 - frames_per_window(config.control_period), 0)
    path, times = trajectory.robot_poses[first : row + 1], trajectory.times[first : row + 1]
    scores = trajectory.scores[row - 1] if row else np.array([np.nan])
    return SceneView(
        corners=layout.room.corners,
        robot_pose=path[-1],
        robot_radius=trajectory.robot_radius,
        goal=layout.goal,
        arrival_radius=config.robot.arrival_radius,
        people_poses=people_poses,
        people_walk=layout.people_walk,
        people_radius=trajectory.people_radius,
        object_poses=layout.object_poses,
        object_sizes=layout.object_sizes,
        object_kinds=layout.object_kinds,
        interaction_lines=_lines(trajectory, row, people_poses),
        trail=path[:, :2],
        trail_marks=path[select_window((config.reward.time_scale * times).tolist())[1:]],
        scores=None if np.isnan(scores).any() else Scores(*scores.tolist()),
        time=row * config.control_period,
        time_limit=config.time_limit,
        outcome=trajectory.outcome if row == len(trajectory) else None,
    )
