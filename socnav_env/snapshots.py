"""From the world to what the reward model reads: snapshots in the robot's frame, and the window of the last seconds."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from reward_model.graph import FRAME_SPACING, NUM_FRAMES, FrameGraph, frame_graph, wall_segments
from reward_model.jit import njit
from reward_model.scenario import DEFAULT_INTERVAL, Interactions, Objects, People, Snapshot
from socnav_env.frames import closed_lines, points_in_frame, pose_rates, poses_in_frame
from socnav_env.layout import FloatArray

if TYPE_CHECKING:
    from socnav_env.world import World


class Recorder:
    """Takes snapshots of one episode's world and keeps those that a window can still need.

    The first one is taken when the recorder is made; like the first of every recorded sequence it has no
    velocities. Each snapshot becomes a frame graph once, which all windows share.

    control_period: [s] between two snapshots
    """

    def __init__(self, world: World, control_period: float) -> None:
        layout = world.layout
        self._world = world
        self._control_period = control_period
        self._people_ids = np.arange(1, layout.num_people + 1)
        self._object_ids = np.arange(layout.num_people + 1, layout.num_people + layout.num_objects + 1)
        self._interactions = Interactions(layout.interaction_pairs + 1, layout.interaction_relations)
        self._object_sizes = layout.object_sizes
        # SocNav2's recordings list walls clockwise, and the published network's answers depend on it.
        self._corners = np.ascontiguousarray(layout.room.corners[::-1])
        self._segments = wall_segments(closed_lines(self._corners))
        self._fixed_poses = layout.object_poses
        self._poses: FloatArray | None = None  # of people, then objects, in the last snapshot
        capacity = frames_per_window(control_period)
        self._ages = range(0, capacity, (capacity - 1) // (NUM_FRAMES - 1))  # in control periods
        self._snapshots: deque[Snapshot] = deque(maxlen=capacity)
        self._frames: deque[FrameGraph] = deque(maxlen=capacity)
        self.record()

    def record(self) -> None:
        """Take a snapshot of the world as it is now; once after every control period."""
        snapshot = self._snapshot()
        self._snapshots.append(snapshot)
        self._frames.append(frame_graph(snapshot, self._segments))

    @property
    def snapshots(self) -> tuple[Snapshot, ...]:
        """The last two seconds and a little, oldest first."""
        return tuple(self._snapshots)

    def window(self) -> list[FrameGraph]:
        """The frames that the last second is judged by: up to three, a second apart, newest first.

        Those that `select_window` names: snapshots come at one rate, so it is always the same places.
        """
        return [self._frames[-1 - age] for age in self._ages if age < len(self._frames)]

    def _snapshot(self) -> Snapshot:
        robot_pose, num_people = self._world.robot_pose, len(self._people_ids)
        poses, goal, walls = _seen_from(
            robot_pose, self._world.people_poses, self._fixed_poses, self._world.layout.goal, self._corners
        )
        velocities = pose_rates(poses if self._poses is None else self._poses, poses, self._control_period)
        self._poses = poses
        return Snapshot(
            timestamp=self._world.time,
            interval=DEFAULT_INTERVAL,
            command=self._world.command,
            goal=goal,
            people=People(self._people_ids, poses[:num_people], velocities[:num_people]),
            objects=Objects(self._object_ids, poses[num_people:], velocities[num_people:], self._object_sizes),
            walls=walls,
            interactions=self._interactions,
            robot_pose=robot_pose,
        )


@njit
def _seen_from(
    frame: FloatArray, people: FloatArray, objects: FloatArray, goal: FloatArray, corners: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """In the frame that stands at a pose: people's poses, then objects', (n, 3); the goal, (2,); the walls, (n, 4)."""
    poses = np.empty((len(people) + len(objects), 3))
    poses[: len(people)], poses[len(people) :] = people, objects
    walls = closed_lines(points_in_frame(frame, corners))
    return poses_in_frame(frame, poses), points_in_frame(frame, goal.reshape(1, 2))[0], walls


def frames_per_window(control_period: float) -> int:
    """How many snapshots, one each control period [s], a window reaches across."""
    return (NUM_FRAMES - 1) * math.ceil(FRAME_SPACING / control_period - 1e-6) + 1
