"""Conversion of SocNav2 scenes to `Trajectory`, so that they are measured like simulated episodes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from reward_model.base.angles import wrap_angles
from reward_model.base.arrays import FloatArray
from reward_model.scenes.scene import Objects, People, ScenarioError, SceneSequence, Snapshot
from socnav_env.config import PeopleConfig, RobotConfig
from socnav_env.layout import Layout, ObjectKind, Room
from socnav_env.trajectories.trajectory import Trajectory

STANDING_SPREAD = 0.1  # m, maximum extent of a standing person's positions
WALL_GAP = 0.01  # m between the ends of two walls that meet


def trajectory_of_sequence(
    sequence: SceneSequence,
    robot_radius: float = RobotConfig.radius,
    people_radius: float = PeopleConfig.radius,
) -> Trajectory:
    """A recorded scene as a trajectory, in the room's frame.

    A scene has no outcome, radii, targets of people, or top speed of the robot. The outcome is None, radii are taken as
    given [m], and all else is NaN. Velocities are those between two snapshots. A person is NaN while out of sight.

    Raises:
        ScenarioError: If a snapshot has no `robot_pose`.
    """
    robot_poses = np.array([_robot_pose(sequence, index) for index in range(len(sequence))])
    times = np.array([snapshot.timestamp for snapshot in sequence])
    people_ids, people_poses = _tracks(sequence, robot_poses, lambda snapshot: snapshot.people)
    object_ids, object_poses = _tracks(sequence, robot_poses, lambda snapshot: snapshot.objects)
    rows, num_people = people_poses.shape[:2]
    layout = _layout(sequence, robot_poses[0], people_ids, people_poses, object_ids, object_poses)
    return Trajectory(
        layout=layout,
        times=times,
        robot_radius=robot_radius,
        people_radius=people_radius,
        top_speed=np.nan,
        robot_poses=robot_poses,
        robot_velocities=_rates(robot_poses[:, None], times)[:, 0],
        people_poses=people_poses,
        people_velocities=_rates(people_poses, times),
        people_targets=np.full((rows, num_people, 2), np.nan),
        commands=np.array([snapshot.command for snapshot in sequence])[1:],
        scores=np.full((rows - 1, 2), np.nan),
        outcome=None,
    )


def _layout(
    sequence: SceneSequence,
    robot_pose: FloatArray,
    people_ids: list[int],
    people_poses: FloatArray,
    object_ids: list[int],
    object_poses: FloatArray,
) -> Layout:
    """The layout at the start of the scene; people and objects that appear later have their first pose."""
    pairs = _pairs(sequence)
    entity = {identity: index for index, identity in enumerate([*people_ids, *object_ids])}
    goal, walls = sequence.snapshots[0].goal, sequence.snapshots[0].walls
    people = [_first_seen(people_poses[:, index]) for index in range(len(people_ids))]
    objects = [_first_seen(object_poses[:, index]) for index in range(len(object_ids))]
    indices = [[entity[one], entity[other]] for one, other in pairs]
    return Layout(
        room=_room(_points_in_room(robot_pose, walls.reshape(-1, 2)).reshape(-1, 4)),
        robot_pose=robot_pose,
        goal=_points_in_room(robot_pose, goal[None])[0],
        people_poses=np.array(people).reshape(-1, 3),
        people_walk=_spread(people_poses) > STANDING_SPREAD,
        people_group=np.full(len(people_ids), -1),
        object_poses=np.array(objects).reshape(-1, 3),
        object_sizes=_sizes(sequence, object_ids),
        object_kinds=np.full(len(object_ids), ObjectKind.TABLE, dtype=np.int64),
        interaction_pairs=np.array(indices, dtype=np.int64).reshape(-1, 2),
        interaction_relations=tuple(pairs.values()),
    )


def _robot_pose(sequence: SceneSequence, index: int) -> FloatArray:
    pose = sequence.snapshots[index].robot_pose
    if pose is None:
        raise ScenarioError(f"{sequence.name}: snapshot {index}: robot_pose is missing, the robot's path needs it")
    return pose


def _points_in_room(robot_pose: FloatArray, points: FloatArray) -> FloatArray:
    """Points (n, 2) in the robot's frame, converted to the room's."""
    cosine, sine = np.cos(robot_pose[2]), np.sin(robot_pose[2])
    return np.asarray(points @ np.array([[cosine, sine], [-sine, cosine]]) + robot_pose[:2])


def _tracks(
    sequence: SceneSequence, robot_poses: FloatArray, entities_of: Callable[[Snapshot], People | Objects]
) -> tuple[list[int], FloatArray]:
    """All entities' ids, in order of appearance, and their poses in the room, (num_snapshots, num_ids, 3)."""
    ids = list(dict.fromkeys(int(each) for snapshot in sequence for each in entities_of(snapshot).ids))
    poses = np.full((len(sequence), len(ids), 3), np.nan)
    for row, (snapshot, robot_pose) in enumerate(zip(sequence, robot_poses, strict=True)):
        entities = entities_of(snapshot)
        columns = [ids.index(int(each)) for each in entities.ids]
        poses[row, columns, :2] = _points_in_room(robot_pose, entities.poses[:, :2])
        poses[row, columns, 2] = entities.poses[:, 2] + robot_pose[2]
    return ids, poses


def _first_seen(poses: FloatArray) -> FloatArray:
    return np.asarray(poses[np.argmax(~np.isnan(poses[:, 0]))])


def _spread(poses: FloatArray) -> FloatArray:
    """(num_ids,) [m] the longer side of each one's bounding box."""
    places = poses[..., :2]
    return np.asarray((np.fmax.reduce(places, axis=0) - np.fmin.reduce(places, axis=0)).max(axis=1, initial=0.0))


def _rates(poses: FloatArray, times: FloatArray) -> FloatArray:
    """Velocities of poses (n, num_ids, 3) from row to row; NaN in the first row."""
    changes = np.diff(poses, axis=0)
    changes[..., 2] = wrap_angles(changes[..., 2])
    return np.concatenate([np.full_like(poses[:1], np.nan), changes / np.diff(times)[:, None, None]])


def _sizes(sequence: SceneSequence, object_ids: list[int]) -> FloatArray:
    sizes: dict[int, FloatArray] = {}
    for snapshot in reversed(sequence.snapshots):
        sizes |= dict(zip(snapshot.objects.ids.tolist(), snapshot.objects.sizes, strict=True))
    return np.array([sizes[identity] for identity in object_ids]).reshape(-1, 2)


def _pairs(sequence: SceneSequence) -> dict[tuple[int, int], str]:
    """All pairs that interact at any time, each once, with their relations."""
    pairs: dict[tuple[int, int], str] = {}
    for snapshot in sequence:
        for (one, other), relation in zip(
            snapshot.interactions.pairs.tolist(), snapshot.interactions.relations, strict=True
        ):
            if (other, one) not in pairs:
                pairs.setdefault((one, other), relation)
    return pairs


def _room(walls: FloatArray) -> Room:
    """The room that walls enclose; one without corners if consecutive walls do not meet."""
    ends = np.roll(walls[:, :2], -1, axis=0)
    if len(walls) < 3 or np.abs(walls[:, 2:] - ends).max() > WALL_GAP:
        return Room(np.zeros((0, 2)))
    x, y = walls[:, 0], walls[:, 1]
    area = float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
    return Room(walls[:, :2] if area > 0 else walls[::-1, :2])
