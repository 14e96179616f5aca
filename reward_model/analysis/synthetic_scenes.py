"""Scenes of constant motions in a square room, in SI units, for measurements of a reward model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from reward_model.base.arrays import FloatArray
from reward_model.graph.features import FRAME_SPACING, NUM_FRAMES
from reward_model.scenes.poses import driven, placed_at, seen_from
from reward_model.scenes.scene import (
    DEFAULT_INTERVAL,
    Interactions,
    Objects,
    People,
    SceneSequence,
    Snapshot,
)

_DURATION: Final = (NUM_FRAMES - 1) * FRAME_SPACING  # s


class Person(NamedTuple):
    """A person who stands or walks straight ahead: position now [m], heading [rad], speed [m/s]."""

    x: float
    y: float
    heading: float = 0.0
    speed: float = 0.0


class Thing(NamedTuple):
    """An object: position [m], heading [rad], width and depth [m]."""

    x: float
    y: float
    heading: float
    width: float
    depth: float


@dataclass(frozen=True)
class SyntheticScene:
    """A square room centred on the origin, at the moment that is scored. People have the ids from 1 on.

    Attributes:
        side: [m]
        goal: x, y [m]
        robot: x [m], y [m], heading [rad]
        command: forward speed [m/s] and turn rate [rad/s], constant over the whole window
        interactions: pairs of ids; ids of objects follow those of people
    """

    goal: tuple[float, float]
    side: float = 9.0
    robot: tuple[float, float, float] = (0.0, 0.0, 0.0)
    command: tuple[float, float] = (0.0, 0.0)
    people: Sequence[Person] = ()
    objects: Sequence[Thing] = ()
    interactions: Sequence[tuple[int, int]] = ()

    def sequence(self, name: str = "synthetic") -> SceneSequence:
        """The last two seconds, from which the window is taken, a snapshot every 0.2 s."""
        times = DEFAULT_INTERVAL * np.arange(round(_DURATION / DEFAULT_INTERVAL) + 1)
        return SceneSequence(tuple(self._snapshot(float(time)) for time in times), name)

    def _snapshot(self, time: float) -> Snapshot:
        """The snapshot at a time [s] since the first one."""
        age = _DURATION - time
        robot = self._robot_pose(age)
        half = self.side / 2
        corners = np.array([[half, half, 0], [half, -half, 0], [-half, -half, 0], [-half, half, 0]])
        seen_corners = seen_from(robot, corners)[:, :2]  # clockwise, as in recordings
        num_people, num_objects = len(self.people), len(self.objects)
        return Snapshot(
            timestamp=time,
            interval=DEFAULT_INTERVAL,
            command=np.array([self.command[0], 0.0, self.command[1]]),
            goal=seen_from(robot, np.array([*self.goal, 0.0]))[:2],
            people=People(np.arange(1, num_people + 1), *self._motion(self._people_poses, age)),
            objects=Objects(
                np.arange(num_people + 1, num_people + num_objects + 1),
                *self._motion(self._object_poses, age),
                np.array([[thing.width, thing.depth] for thing in self.objects]).reshape(-1, 2),
            ),
            walls=np.hstack([seen_corners, np.roll(seen_corners, -1, axis=0)]),
            interactions=Interactions(
                np.array(self.interactions, dtype=np.int64).reshape(-1, 2), ("interacting",) * len(self.interactions)
            ),
        )

    def _robot_pose(self, age: float) -> FloatArray:
        return placed_at(np.array(self.robot), driven(*self.command, -age))

    def _people_poses(self, age: float) -> FloatArray:
        rows = np.array(self.people, dtype=np.float64).reshape(-1, 4)
        walked = -age * rows[:, 3:] * np.column_stack([np.cos(rows[:, 2]), np.sin(rows[:, 2])])
        return np.hstack([rows[:, :2] + walked, rows[:, 2:3]])

    def _object_poses(self, age: float) -> FloatArray:
        return np.array(self.objects, dtype=np.float64).reshape(-1, 5)[:, :3]

    def _motion(self, poses_at: Callable[[float], FloatArray], age: float) -> tuple[FloatArray, FloatArray]:
        """Poses and velocities in the robot's frame; velocities are displacements over the interval before."""
        seen = seen_from(self._robot_pose(age), poses_at(age))
        before = age + DEFAULT_INTERVAL
        return seen, (seen - seen_from(self._robot_pose(before), poses_at(before))) / DEFAULT_INTERVAL
