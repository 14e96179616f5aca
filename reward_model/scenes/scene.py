"""Recorded scenes in the robot's frame: `Snapshot` and `SceneSequence`.

This module and all that import it have one convention: SI units and REP-103 frames. The robot stands at the
origin, x points forward, y to its left, angles grow counter-clockwise and 0 is straight ahead.
Velocities are true velocities *relative to the robot*, expressed in its frame: the rate at which an entity's
pose in the robot's frame changes, so they contain the robot's own motion.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from reward_model.base.arrays import FloatArray, IntArray

DEFAULT_INTERVAL = 0.2  # s between a snapshot and the one before it, where a recording does not give it


class ScenarioError(ValueError):
    """A recorded scene breaks a rule. The message names the place, the value and the rule."""


class Scores(NamedTuple):
    """Acceptability of the robot's last second to people, 0 (unacceptable) to 1 (perfect).

    `q1` rates the absence of disturbance alone, `q2` efficient progress to the goal as well. Those of the published
    network may lie slightly above 1. `q1_std` and `q2_std` are the standard deviations over the members of an ensemble,
    0 for a single network. `in_range` is whether the scene is like those of the network's training, as far as known.
    """

    q1: float
    q2: float
    q1_std: float = 0.0
    q2_std: float = 0.0
    in_range: bool = True


@dataclass(frozen=True, eq=False)
class People:
    """The people in a snapshot.

    Attributes:
        ids: (num_people,) unique among people and objects
        poses: (num_people, 3) x [m], y [m], heading [rad]
        velocities: (num_people, 3) [m/s, m/s, rad/s], relative to the robot
    """

    ids: IntArray
    poses: FloatArray
    velocities: FloatArray

    def __len__(self) -> int:
        return len(self.ids)


@dataclass(frozen=True, eq=False)
class Objects:
    """The objects (tables, laptops, plants) in a snapshot.

    Attributes:
        ids: (num_objects,) unique among people and objects
        poses: (num_objects, 3) x [m], y [m], heading [rad]
        velocities: (num_objects, 3) [m/s, m/s, rad/s], relative to the robot
        sizes: (num_objects, 2) width and depth [m]
    """

    ids: IntArray
    poses: FloatArray
    velocities: FloatArray
    sizes: FloatArray

    def __len__(self) -> int:
        return len(self.ids)


@dataclass(frozen=True, eq=False)
class Interactions:
    """Interactions between people and objects, each pair once.

    Attributes:
        pairs: (num_interactions, 2) ids of people or objects
        relations: name of each pair's relation, e.g. `two_static_person_talking`
    """

    pairs: IntArray
    relations: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.relations)


@dataclass(frozen=True, eq=False)
class Snapshot:
    """One instant of a scene in the robot's frame.

    Attributes:
        timestamp: [s], from any origin
        interval: [s] over which velocities were measured; the graph's features are displacements over it
        command: (3,) forward speed [m/s], speed to the left [m/s], turn rate [rad/s]
        goal: (2,) [m]
        walls: (num_walls, 4) x1, y1, x2, y2 [m]
        robot_pose: (3,) x [m], y [m], heading [rad] in the room's frame, where it is known
    """

    timestamp: float
    interval: float
    command: FloatArray
    goal: FloatArray
    people: People
    objects: Objects
    walls: FloatArray
    interactions: Interactions
    robot_pose: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class SceneSequence:
    """Snapshots of one scene, oldest first, checked on construction.

    Raises:
        ScenarioError: Naming the snapshot and the field that breaks a rule.
    """

    snapshots: tuple[Snapshot, ...]
    name: str = field(default="sequence")

    def __post_init__(self) -> None:
        if not self.snapshots:
            raise ScenarioError(f"{self.name}: a sequence needs at least one snapshot, got none")
        for index, snapshot in enumerate(self.snapshots):
            _check_snapshot(snapshot, f"{self.name}: snapshot {index}")
        for index in range(1, len(self.snapshots)):
            earlier, later = self.snapshots[index - 1].timestamp, self.snapshots[index].timestamp
            if not later > earlier:
                raise ScenarioError(
                    f"{self.name}: snapshot {index}: timestamp must be later than the one before it, "
                    f"got {later} after {earlier}"
                )

    def __len__(self) -> int:
        return len(self.snapshots)

    def __iter__(self) -> Iterator[Snapshot]:
        return iter(self.snapshots)

    @property
    def last(self) -> Snapshot:
        """The newest snapshot, at which the scene is scored."""
        return self.snapshots[-1]


Sequence = SceneSequence
"""The name of `SceneSequence` up to version 0.1, kept for existing code."""


@dataclass(frozen=True, eq=False)
class LabelledSequence:
    """A sequence and one person's scores of it.

    Attributes:
        q1, q2: 0..1, or None where the question was not asked
        scene: the same for every rating and every augmented copy of one scene; splits keep a scene in one part
        rater: name of the rater, empty where unknown
    """

    sequence: SceneSequence
    q1: float | None
    q2: float | None = None
    scene: str = ""
    rater: str = ""


def _check_snapshot(snapshot: Snapshot, where: str) -> None:
    people, objects = snapshot.people, snapshot.objects
    _check_array(snapshot.command, (3,), f"{where}: command")
    _check_array(snapshot.goal, (2,), f"{where}: goal")
    _check_array(people.poses, (len(people), 3), f"{where}: people poses")
    _check_array(people.velocities, (len(people), 3), f"{where}: people velocities")
    _check_array(objects.poses, (len(objects), 3), f"{where}: object poses")
    _check_array(objects.velocities, (len(objects), 3), f"{where}: object velocities")
    _check_array(objects.sizes, (len(objects), 2), f"{where}: object sizes")
    _check_array(snapshot.walls, (len(snapshot.walls), 4), f"{where}: walls")
    if snapshot.robot_pose is not None:
        _check_array(snapshot.robot_pose, (3,), f"{where}: robot_pose")
    if not np.isfinite(snapshot.timestamp):
        raise ScenarioError(f"{where}: timestamp must be a finite number, got {snapshot.timestamp}")
    if not (np.isfinite(snapshot.interval) and snapshot.interval > 0):
        raise ScenarioError(f"{where}: interval must be a positive number, got {snapshot.interval}")
    _check_ids(snapshot, where)


def _check_array(values: FloatArray, shape: tuple[int, ...], where: str) -> None:
    if values.shape != shape:
        raise ScenarioError(f"{where} must have shape {shape}, got {values.shape}")
    if not np.isfinite(values).all():
        raise ScenarioError(f"{where} must be finite numbers, got {values[~np.isfinite(values)][0]}")


def _check_ids(snapshot: Snapshot, where: str) -> None:
    known: set[int] = set()
    for identity in (*snapshot.people.ids.tolist(), *snapshot.objects.ids.tolist()):
        if identity in known:
            raise ScenarioError(f"{where}: id {identity} is used twice; people and objects need ids of their own")
        known.add(identity)
    for source, target in snapshot.interactions.pairs.tolist():
        for identity in (source, target):
            if identity not in known:
                raise ScenarioError(
                    f"{where}: interaction {source}-{target} names id {identity}, which no person or object has"
                )
        if source == target:
            raise ScenarioError(f"{where}: interaction {source}-{target} must join two different entities")
