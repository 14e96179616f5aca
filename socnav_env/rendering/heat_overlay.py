"""Heatmap of the learned score over all positions of the robot, drawn under the scene."""

from __future__ import annotations

from typing import Final

import numpy as np

from reward_model.analysis.heatmap import WindowScorer, score_positions
from reward_model.scenes.poses import rotated
from reward_model.scenes.scene import ScenarioError, SceneSequence
from socnav_env.geometry.distances import inside_each
from socnav_env.layout import Room
from socnav_env.rendering.view import HeatOverlay

RESOLUTION: Final = 20  # cells along the longer side of a room: coarse, but quick enough to watch


def heat_of(scorer: WindowScorer, sequence: SceneSequence, room: Room, resolution: int = RESOLUTION) -> HeatOverlay:
    """The learned score Q2 if the robot had driven the same way elsewhere in the room.

    Args:
        sequence: the last two seconds or more, with the robot's pose in the room
        resolution: cells along the longer side of the room

    Raises:
        ScenarioError: If the last snapshot has no robot pose.
    """
    pose = sequence.last.robot_pose
    if pose is None:
        raise ScenarioError(f"{sequence.name}: a heatmap of the room needs robot_pose")
    low, high = room.corners.min(axis=0), room.corners.max(axis=0)
    counts = np.maximum(np.round(resolution * (high - low) / (high - low).max()), 1).astype(int)
    x, y = (low[axis] + (np.arange(counts[axis]) + 0.5) / counts[axis] * (high - low)[axis] for axis in (0, 1))
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    within = inside_each(places, room.walls)
    scores = np.full(len(places), np.nan)
    scores[within] = score_positions(scorer, sequence, rotated(places[within] - pose[:2], -pose[2]))[:, 1]
    return HeatOverlay(low, high, scores.reshape(*counts))
