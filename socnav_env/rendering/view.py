"""The contents of a picture of a scene, as plain arrays: the interface between scenes and the renderer."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from reward_model.base.arrays import BoolArray, FloatArray, IntArray
from reward_model.scenes.scene import Scores


def _no_rows(columns: int) -> FloatArray:
    return np.zeros((0, columns))


@dataclass(frozen=True, eq=False)
class HeatOverlay:
    """Scores of the robot's last second at other positions in the room.

    Attributes:
        low, high: (2,) opposite corners [m] of the grid
        scores: (num_x, num_y) at the centres of its cells; NaN outside of the room
    """

    low: FloatArray
    high: FloatArray
    scores: FloatArray


@dataclass(frozen=True, eq=False)
class SceneView:
    """The contents of a picture at one instant, in the world frame: SI units, angles counter-clockwise.

    Attributes:
        corners: (num_corners, 2) of the room
        robot_pose: (3,) x, y, heading
        goal: (2,)
        people_poses: (num_people, 3)
        people_walk: (num_people,) whether each one is a walker
        object_poses: (num_objects, 3)
        object_sizes: (num_objects, 2)
        object_kinds: (num_objects,) of `ObjectKind`
        interaction_lines: (num_interactions, 4) x1, y1, x2, y2 between those who interact
        trail: (num_points, 2) the robot's past positions, oldest first
        trail_marks: (num_frames, 3) robot poses of the frames that are scored
        scores: q1 and q2, None without a scorer
        time: [s] since the episode began, of time_limit [s]
        outcome: of the episode, None while it runs
        heat: heatmap drawn under the scene; None for none
        rings: whether the intimate and personal space of everyone is drawn
    """

    corners: FloatArray
    robot_pose: FloatArray
    robot_radius: float
    goal: FloatArray
    arrival_radius: float
    people_poses: FloatArray = field(default_factory=lambda: _no_rows(3))
    people_walk: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    people_radius: float = 0.25
    object_poses: FloatArray = field(default_factory=lambda: _no_rows(3))
    object_sizes: FloatArray = field(default_factory=lambda: _no_rows(2))
    object_kinds: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    interaction_lines: FloatArray = field(default_factory=lambda: _no_rows(4))
    trail: FloatArray = field(default_factory=lambda: _no_rows(2))
    trail_marks: FloatArray = field(default_factory=lambda: _no_rows(3))
    scores: Scores | None = None
    time: float = 0.0
    time_limit: float = 60.0
    outcome: str | None = None
    heat: HeatOverlay | None = None
    rings: bool = False
