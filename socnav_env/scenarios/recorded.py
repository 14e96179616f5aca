"""Scenarios that continue SocNav2 recordings."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, replace
from typing import Final, Self

import numpy as np

from reward_model.base.angles import wrap_angles
from reward_model.base.arrays import BoolArray, FloatArray, IntArray
from reward_model.scenes.poses import aligned
from reward_model.scenes.scene import SceneSequence
from reward_model.scenes.socnav2_json import read_socnav2
from socnav_env.config import AT_LAPTOP, AT_PLANT, WALKING_TOGETHER, EnvConfig
from socnav_env.config.checks import ConfigError
from socnav_env.geometry.distances import boxes_of
from socnav_env.layout import Ending, Layout, ObjectKind, Script
from socnav_env.scenarios.floor import Floor, UnfitError
from socnav_env.scenarios.scripts import Walk, orders_of
from socnav_env.scenes.rooms import is_reachable
from socnav_env.trajectories.from_socnav2 import trajectory_of_sequence
from socnav_env.trajectories.trajectory import Trajectory

UNDER_WAY: Final = 0.1  # m/s, speed from which a person counts as walking
JUST_NOW: Final = 0.5  # s at the end of a recording over which a person's velocity is averaged
LOOK_AHEAD: Final = 6.0  # m, longest way that a person goes straight on
LEAST_WAY: Final = 0.5  # m, shortest way that a person goes straight on
SPEEDS: Final = (0.1, 2.0)  # m/s, limits of a desired speed taken from a recording
SMALL: Final = 0.5  # m, maximum side of an object taken for a plant
SAME_PLACE: Final = 0.05  # m between a table and its laptop


@dataclass(frozen=True, eq=False)
class RecordedScenario:
    """A scenario that starts at the end of a recording; see `Scenario`.

    The recorded seconds are the warm-up. People who have moved go on straight ahead and then wander.
    """

    name: str
    file: str
    recorded: Trajectory

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> Self:
        """Read a file. Raises `ScenarioError` or `ConfigError` naming the file and the error."""
        file = os.fspath(path)
        sequence = _with_robot_poses(read_socnav2(path), file)
        recorded = trajectory_of_sequence(sequence)
        if len(recorded.layout.room.corners) < 3:
            raise ConfigError(f"{file}: walls must close, each beginning where the one before ends")
        return cls(os.path.splitext(os.path.basename(file))[0], file, recorded)

    @property
    def description(self) -> str:
        """The file that it continues."""
        return f"Goes on where {self.file} ends."

    def adapt(self, config: EnvConfig) -> EnvConfig:
        """The configuration, unchanged."""
        return config

    def draw(self, config: EnvConfig, rng: np.random.Generator) -> Layout:
        """The layout at the last moment of the recording, without random numbers."""
        recorded = self.recorded
        layout = _last_moment(recorded)
        floor = Floor(layout.room, boxes_of(layout.object_poses, layout.object_sizes))
        self._check_start(layout, floor, config)
        seen = ~np.isnan(recorded.people_poses[-1, :, 0])
        times = recorded.times[-1] - config.control_period * np.arange(config.warm_up_steps, -1, -1)
        people = np.stack([_track(recorded.times, poses, times) for poses in _columns(recorded, seen)], axis=1)
        velocities = _last_velocities(recorded, seen)
        walks = _walks(recorded, layout, floor, velocities, config)
        # Only people under way have velocities, so that nobody slides.
        velocities[[not walk.under_way for walk in walks]] = 0.0
        script = Script(
            robot_poses=_track(recorded.times, recorded.robot_poses, times),
            commands=_commands(recorded, times[1:]),
            people_poses=people,
            velocities=velocities,
            **orders_of(walks),
        )
        return replace(layout, people_poses=people[-1], robot_pose=script.robot_poses[-1], script=script)

    def _check_start(self, layout: Layout, floor: Floor, config: EnvConfig) -> None:
        robot, start = config.robot, layout.robot_pose[:2]
        try:
            floor.require_room(start, robot.radius, "robot")
        except UnfitError as failure:
            raise ConfigError(f"{self.file}: at the end {failure}") from None
        gaps = np.hypot(*(layout.people_poses[:, :2] - start).T) - robot.radius - config.people.radius
        if np.min(gaps, initial=np.inf) <= 0:
            raise ConfigError(f"{self.file}: at the end the robot must not touch a person, got {np.min(gaps):.2f} m")
        if math.dist(start, layout.goal) < robot.arrival_radius:
            raise ConfigError(
                f"{self.file}: at the end the robot must be farther than {robot.arrival_radius:g} m from its goal"
            )
        standing = layout.people_poses[~layout.people_walk].copy()
        standing[:, 2] = config.people.radius
        if not is_reachable(
            start, layout.goal, robot.arrival_radius, robot.radius, layout.room.walls, standing, floor.boxes
        ):
            raise ConfigError(f"{self.file}: goal must be within the robot's reach, past all that stands")


def _with_robot_poses(sequence: SceneSequence, file: str) -> SceneSequence:
    """The scene with the robot's pose in every snapshot, derived from the walls if it is not recorded."""
    last = sequence.last
    if all(snapshot.robot_pose is not None for snapshot in sequence):
        return sequence
    if any(len(snapshot.walls) != len(last.walls) or not len(last.walls) for snapshot in sequence):
        raise ConfigError(f"{file}: robot_pose is missing, and the walls do not tell it: they change or there are none")
    poses = [aligned(snapshot.walls.reshape(-1, 2), last.walls.reshape(-1, 2)) for snapshot in sequence]
    return SceneSequence(
        tuple(replace(each, robot_pose=pose) for each, pose in zip(sequence, poses, strict=True)), sequence.name
    )


def _last_moment(recorded: Trajectory) -> Layout:
    """The layout of the people observed at the end, at their last poses."""
    layout, last = recorded.layout, recorded.people_poses[-1]
    seen = ~np.isnan(last[:, 0])
    index = np.full(layout.num_people + layout.num_objects, -1)
    kept = np.concatenate([seen, np.ones(layout.num_objects, dtype=np.bool_)])
    index[kept] = np.arange(kept.sum())
    pairs = index[layout.interaction_pairs].reshape(-1, 2)
    present = (pairs >= 0).all(axis=1)
    relations = np.array(layout.interaction_relations, dtype=object)[present].tolist()
    walks = layout.people_walk[seen]
    return replace(
        layout,
        robot_pose=recorded.robot_poses[-1],
        people_poses=last[seen],
        people_walk=walks,
        people_group=_groups(pairs[present], relations, walks),
        object_kinds=_kinds(layout, pairs[present] - int(seen.sum()), relations),
        interaction_pairs=pairs[present],
        interaction_relations=tuple(relations),
    )


def _groups(pairs: IntArray, relations: list[str], walks: BoolArray) -> IntArray:
    """Group number of each person; -1 for people on their own."""
    groups = np.full(len(walks), -1)
    for number, (pair, relation) in enumerate(zip(pairs.tolist(), relations, strict=True)):
        if relation == WALKING_TOGETHER and max(pair) < len(walks) and walks[pair].all():
            groups[pair] = number
    return groups


def _kinds(layout: Layout, pairs: IntArray, relations: list[str]) -> IntArray:
    """The kind of each object, which recordings lack: derived from its interactions, its size and its place.

    Args:
        pairs: (num_interactions, 2) indices of objects; people are negative
    """
    kinds = np.where(layout.object_sizes.max(axis=1, initial=0.0) < SMALL, ObjectKind.PLANT, ObjectKind.TABLE)
    for pair, relation in zip(pairs.tolist(), relations, strict=True):
        for thing in (each for each in pair if each >= 0):
            kinds[thing] = {AT_LAPTOP: ObjectKind.LAPTOP, AT_PLANT: ObjectKind.PLANT}.get(relation, kinds[thing])
    places = layout.object_poses[:, :2]
    for thing in range(1, len(kinds)):
        if np.hypot(*(places[:thing] - places[thing]).T).min() < SAME_PLACE and ObjectKind.LAPTOP not in kinds[:thing]:
            kinds[thing] = ObjectKind.LAPTOP
    return kinds.astype(np.int64)


def _columns(recorded: Trajectory, seen: BoolArray) -> list[FloatArray]:
    """Poses (num_rows, 3) of each person observed at the end; before they appear, their first pose."""
    columns = []
    for poses in recorded.people_poses[:, seen].transpose(1, 0, 2):
        known = ~np.isnan(poses[:, 0])
        columns.append(_track(recorded.times[known], poses[known], recorded.times))
    return columns


def _track(times: FloatArray, poses: FloatArray, wanted: FloatArray) -> FloatArray:
    """Poses (n, 3) at other times, interpolated linearly; before the first time, the first pose."""
    headings = np.unwrap(poses[:, 2])
    columns = [np.interp(wanted, times, column) for column in (poses[:, 0], poses[:, 1], headings)]
    columns[2] = wrap_angles(columns[2])
    return np.column_stack(columns)


def _commands(recorded: Trajectory, wanted: FloatArray) -> FloatArray:
    """The robot's commands in the periods that end at these times, (num_periods, 3); 0 before the recording."""
    if not len(recorded.commands):
        return np.zeros((len(wanted), 3))
    rows = np.searchsorted(recorded.times[1:], wanted - 1e-6).clip(max=len(recorded.commands) - 1)
    return np.where((wanted > recorded.times[0] + 1e-6)[:, None], recorded.commands[rows], 0.0)


def _last_velocities(recorded: Trajectory, seen: BoolArray) -> FloatArray:
    """Velocities (num_seen, 3) of the people observed at the end, averaged over the last moments."""
    latest = recorded.times > recorded.times[-1] - JUST_NOW
    velocities = recorded.people_velocities[latest][:, seen]
    known = ~np.isnan(velocities)
    total = np.where(known, velocities, 0.0).sum(axis=0)
    return np.asarray(total / np.maximum(known.sum(axis=0), 1))


def _walks(recorded: Trajectory, layout: Layout, floor: Floor, velocities: FloatArray, config: EnvConfig) -> list[Walk]:
    """Each person's walk: straight on for those under way; then, like all who walk, they wander."""
    seen = ~np.isnan(recorded.people_poses[-1, :, 0])
    speeds = np.hypot(*np.moveaxis(recorded.people_velocities[:, seen, :2], -1, 0))
    walks = []
    for index, (pose, velocity) in enumerate(zip(layout.people_poses, velocities, strict=True)):
        own = speeds[:, index][speeds[:, index] > UNDER_WAY]
        speed = float(np.clip(own.mean(), *SPEEDS)) if len(own) and layout.people_walk[index] else math.nan
        now = math.hypot(velocity[0], velocity[1])
        if not layout.people_walk[index] or now < UNDER_WAY:
            walks.append(Walk(speed=speed))
            continue
        direction = velocity[:2] / now
        way = floor.free_way(pose[:2], direction, LOOK_AHEAD, config.people.radius)
        end = tuple((pose[:2] + way * direction).tolist())
        walks.append(Walk(speed, True, (end,) if way > LEAST_WAY else (), 0.0, Ending.WANDER))
    return _walking_together(walks, layout.people_group)


def _walking_together(walks: list[Walk], groups: IntArray) -> list[Walk]:
    """The same walks, with the route of the first member who has one for the whole group."""
    together = list(walks)
    for group in set(groups.tolist()) - {-1}:
        members = np.flatnonzero(groups == group).tolist()
        leading = next((walks[each] for each in members if walks[each].route), walks[members[0]])
        for member in members:
            together[member] = replace(walks[member], route=leading.route, speed=leading.speed)
    return together
