"""The reward model's input from the world: snapshots in the robot's frame, and the window of the last seconds."""

from __future__ import annotations

import math
from collections import deque
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reward_model.base.arrays import FloatArray, Int32Array, IntArray
from reward_model.base.numba import njit
from reward_model.graph.features import FRAME_SPACING, NUM_FRAMES
from reward_model.graph.frame import FrameGraph
from reward_model.graph.frame_kernels import Entities, packed_frame
from reward_model.graph.windows import check_links, wall_segments
from reward_model.scenes.scene import DEFAULT_INTERVAL, Interactions, Objects, People, Snapshot
from socnav_env.geometry.frames import closed_lines, points_in_frame, pose_rates, poses_in_frame
from socnav_env.people.interactions import InteractionPairs

if TYPE_CHECKING:
    from socnav_env.simulation.world import World


class _Scene(NamedTuple):
    """The parts of a scene that stay the same during an episode.

    Attributes:
        ids: (num_entities,) of people, then of objects
        objects: (num_objects, 3) poses in the room's frame
        sizes: (num_objects, 2)
        goal: (2,)
        corners: (num_walls, 2)
        segments: (num_walls,) as in `wall_segments`
        pairs: (num_interactions, 2) ids
    """

    ids: IntArray
    objects: FloatArray
    sizes: FloatArray
    goal: FloatArray
    corners: FloatArray
    segments: IntArray
    pairs: IntArray


class _State(NamedTuple):
    """The parts of a scene that change; see `World`."""

    time: float
    command: FloatArray
    robot_pose: FloatArray
    people_poses: FloatArray
    interactions: InteractionPairs


class Recorder:
    """Takes snapshots of one episode's world and keeps those that a window can still need.

    The first one is taken on construction; like the first of every recorded sequence it has no velocities. Each moment
    becomes a frame graph once, which all windows share, and a `Snapshot` on demand.

    Args:
        control_period: [s] between two snapshots
        time_scale: factor by which the scene of the frames is slowed, see `reward_model.scenes.time_scale.slowed`;
            snapshots are in real time

    Raises:
        ScenarioError: If two objects interact.
    """

    def __init__(self, world: World, control_period: float, time_scale: float = 1.0) -> None:
        layout = world.layout
        self._world = world
        self._control_period, self._time_scale = control_period, time_scale
        # SocNav2's recordings list walls clockwise, and the published network's scores depend on it.
        corners = np.ascontiguousarray(layout.room.corners[::-1])
        self._scene = _Scene(
            ids=np.arange(1, layout.num_people + layout.num_objects + 1),
            objects=layout.object_poses,
            sizes=layout.object_sizes,
            goal=layout.goal,
            corners=corners,
            segments=wall_segments(closed_lines(corners)),
            pairs=world.interactions.pairs + 1,
        )
        capacity = frames_per_window(control_period * time_scale)
        self._ages = range(0, capacity, (capacity - 1) // (NUM_FRAMES - 1))  # in control periods
        self._states: deque[_State] = deque([self._state()], maxlen=capacity + 1)  # including the one before the first
        self._frames: deque[FrameGraph] = deque(maxlen=capacity)
        self.record()
        check_links(self._frames[0])

    def record(self) -> None:
        """Take a snapshot of the world, once after every control period."""
        earlier, now = self._states[-1], self._state()
        if now.interactions is not earlier.interactions:
            self._scene = self._scene._replace(pairs=now.interactions.pairs + 1)
        words = _frame(
            self._scene,
            earlier.robot_pose,
            earlier.people_poses,
            now.robot_pose,
            now.people_poses,
            now.command,
            self._control_period,
            self._time_scale,
        )
        self._states.append(now)
        self._frames.append(FrameGraph.of_words(words))

    @property
    def snapshots(self) -> tuple[Snapshot, ...]:
        """Snapshots in real time of slightly more than a window, oldest first: the last two seconds, if not slowed."""
        return tuple(self._snapshot(earlier, now) for earlier, now in pairwise(self._states))

    def window(self) -> list[FrameGraph]:
        """The frames scored for the last second: up to three, a second apart, newest first.

        They are those of `select_window`; snapshots come at one rate, so their indices are always the same. A second is
        one of slowed time.
        """
        return [self._frames[-1 - age] for age in self._ages if age < len(self._frames)]

    def _state(self) -> _State:
        world, state = self._world, self._world.state
        return _State(world.time, world.command, state.robot_pose, state.people_poses, world.interactions)

    def _snapshot(self, earlier: _State, now: _State) -> Snapshot:
        scene, num_people = self._scene, len(now.people_poses)
        poses, goal, walls = _seen_from(scene, now.robot_pose, now.people_poses)
        before, _, _ = _seen_from(scene, earlier.robot_pose, earlier.people_poses)
        velocities = pose_rates(before, poses, self._control_period)
        ids, split = scene.ids, slice(num_people, None)
        return Snapshot(
            timestamp=now.time,
            interval=DEFAULT_INTERVAL,
            command=now.command,
            goal=goal,
            people=People(ids[:num_people], poses[:num_people], velocities[:num_people]),
            objects=Objects(ids[split], poses[split], velocities[split], scene.sizes),
            walls=walls,
            interactions=Interactions(now.interactions.pairs + 1, now.interactions.relations),
            robot_pose=now.robot_pose,
        )


@njit
def _frame(
    scene: _Scene,
    robot_before: FloatArray,
    people_before: FloatArray,
    robot: FloatArray,
    people: FloatArray,
    command: FloatArray,
    duration: float,
    time_scale: float,
) -> Int32Array:
    """The words of the frame graph that `frame_graph` makes of the slowed snapshot of a moment."""
    poses, goal, walls = _seen_from(scene, robot, people)
    velocities = pose_rates(_seen_from(scene, robot_before, people_before)[0], poses, duration)
    if time_scale != 1.0:
        velocities /= time_scale
    num_people = len(people)
    return packed_frame(
        Entities(scene.ids[:num_people], poses[:num_people], velocities[:num_people]),
        Entities(scene.ids[num_people:], poses[num_people:], velocities[num_people:]),
        scene.sizes,
        command / time_scale,
        goal,
        walls,
        scene.segments,
        scene.pairs,
        DEFAULT_INTERVAL,
    )


@njit
def _seen_from(scene: _Scene, robot: FloatArray, people: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The scene in the robot's frame: poses of people, then objects, (n, 3); the goal, (2,); the walls, (n, 4)."""
    poses = np.empty((len(people) + len(scene.objects), 3))
    poses[: len(people)], poses[len(people) :] = people, scene.objects
    walls = closed_lines(points_in_frame(robot, scene.corners))
    return poses_in_frame(robot, poses), points_in_frame(robot, scene.goal.reshape(1, 2))[0], walls


def frames_per_window(control_period: float) -> int:
    """The number of snapshots, one each control period [s] in the time of the window, that a window spans."""
    return (NUM_FRAMES - 1) * max(math.ceil(FRAME_SPACING / control_period - 1e-6), 1) + 1
