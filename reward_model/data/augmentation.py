"""Augmentation of recorded scenes: copies to which a person would give the same scores.

Any scene can be mirrored. Turning the robot round is meant for a driving robot, which then reverses along the same
path; a standing robot, as in SocNav1, then faces something else, and a person would give other scores.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Final, Literal, TypeVar

import numpy as np

from reward_model.base.arrays import FloatArray
from reward_model.graph.features import NUM_FRAMES
from reward_model.graph.windows import select_window
from reward_model.scenes.scene import Objects, People, SceneSequence, Snapshot

Entities = TypeVar("Entities", People, Objects)
Augmentation = Literal["none", "mirror", "all", "moments"]
"""Copies by mirror and all (the paper's) keep the scores; windows of other moments need scores of their own."""

_MIRROR_POSE = np.array([1.0, -1.0, -1.0])  # forward, left, counter-clockwise
_TURN_POSITION = np.array([-1.0, -1.0])
_TURN_VELOCITY = np.array([-1.0, -1.0, 1.0])


def mirrored(sequence: SceneSequence) -> SceneSequence:
    """Swap left and right in a scene, the room and the robot's command included.

    Mirroring twice gives the scene again. The paper's first augmentation (Bachiller et al. 2021).
    """
    return _every_snapshot(sequence, _mirrored_snapshot)


def rotated(sequence: SceneSequence) -> SceneSequence:
    """Turn the robot by 180 degrees without changing any motion: driving forward becomes reversing.

    Everything around the robot turns by 180 degrees in its frame, and its translation changes sign; its turn
    rate stays the same. Rotating twice gives the scene again, headings up to whole turns.
    The paper's second augmentation (Bachiller et al. 2021).
    """
    return _every_snapshot(sequence, _rotated_snapshot)


MOMENTS_APART: Final = 0.5  # s

# The copies of a scene by each augmentation that keeps its scores, the scene itself first.
VARIANTS: Final = MappingProxyType[str, tuple[Callable[[SceneSequence], SceneSequence], ...]](
    {
        "none": (lambda scene: scene,),
        "mirror": (lambda scene: scene, mirrored),
        "all": (lambda scene: scene, mirrored, rotated, lambda scene: mirrored(rotated(scene))),
    }
)


def judged_window(sequence: SceneSequence) -> SceneSequence:
    """The scene with the snapshots of its window alone: its scores are the same, and it is faster to augment."""
    chosen = select_window([snapshot.timestamp for snapshot in sequence])
    return replace(sequence, snapshots=tuple(sequence.snapshots[index] for index in reversed(chosen)))


def judged_moments(sequence: SceneSequence) -> SceneSequence:
    """The scene with the snapshots of its `moments` alone, whose windows stay the same."""
    chosen = {index for window in moments([snapshot.timestamp for snapshot in sequence]) for index in window}
    return replace(sequence, snapshots=tuple(sequence.snapshots[index] for index in sorted(chosen)))


def moments(timestamps: Sequence[float]) -> list[list[int]]:
    """The windows of the last moment and of moments up to 1.5 s before it, where there are any, as indices.

    Args:
        timestamps: [s], oldest first, not empty

    Returns:
        Windows, the last moment's first, of indices of snapshots, newest first; windows share snapshots where possible.
    """
    windows = []
    for age in (0.0, MOMENTS_APART):
        before = [time for time in timestamps if timestamps[-1] - time >= age]
        chosen = select_window(before, NUM_FRAMES + 1) if before else []
        windows += [chosen[:NUM_FRAMES], chosen[1:]]
    return [window for window in windows if window]


def _every_snapshot(sequence: SceneSequence, change: Callable[[Snapshot], Snapshot]) -> SceneSequence:
    return replace(sequence, snapshots=tuple(change(snapshot) for snapshot in sequence))


def _mirrored_snapshot(snapshot: Snapshot) -> Snapshot:
    people, objects, pose = snapshot.people, snapshot.objects, snapshot.robot_pose
    return replace(
        snapshot,
        command=snapshot.command * _MIRROR_POSE,
        goal=snapshot.goal * _MIRROR_POSE[:2],
        people=_moved(people, people.poses * _MIRROR_POSE, people.velocities * _MIRROR_POSE),
        objects=_moved(objects, objects.poses * _MIRROR_POSE, objects.velocities * _MIRROR_POSE),
        walls=snapshot.walls * np.tile(_MIRROR_POSE[:2], 2),
        robot_pose=None if pose is None else pose * _MIRROR_POSE,
    )


def _rotated_snapshot(snapshot: Snapshot) -> Snapshot:
    people, objects, pose = snapshot.people, snapshot.objects, snapshot.robot_pose
    return replace(
        snapshot,
        command=snapshot.command * _TURN_VELOCITY,
        goal=-snapshot.goal,
        people=_moved(people, _turned(people.poses), people.velocities * _TURN_VELOCITY),
        objects=_moved(objects, _turned(objects.poses), objects.velocities * _TURN_VELOCITY),
        walls=-snapshot.walls,
        robot_pose=None if pose is None else np.array([pose[0], pose[1], _opposite(pose[2])]),
    )


def _moved(entities: Entities, poses: FloatArray, velocities: FloatArray) -> Entities:
    return replace(entities, poses=poses, velocities=velocities)


def _turned(poses: FloatArray) -> FloatArray:
    """Poses (num_entities, 3) in the frame of a robot that turned by 180 degrees."""
    return np.column_stack([poses[:, :2] * _TURN_POSITION, _opposite(poses[:, 2])])


def _opposite(heading: FloatArray) -> FloatArray:
    return heading - np.copysign(math.pi, heading)
