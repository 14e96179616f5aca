"""A recorded episode: what metrics and replays read. Plain arrays, one row a step."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from socnav_env.layout import FloatArray, Layout
from socnav_env.outcomes import Outcome

if TYPE_CHECKING:
    from reward_model.scenario import Scores
    from socnav_env.world import World


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A recorded episode of n steps in the world frame. Row 0 is its start, row k the state after step k.

    layout: the room, the objects, the goal, and who interacts with whom
    control_period: [s] of a step
    robot_poses: (n + 1, 3); robot_velocities: (n + 1, 3) over ground
    people_poses: (n + 1, num_people, 3); people_velocities: (n + 1, num_people, 3) over ground
    scores: (n, 2) q1 and q2 after each step, NaN where nobody judged
    outcome: how it ended; None for an episode that was broken off
    """

    layout: Layout
    control_period: float
    robot_radius: float
    people_radius: float
    robot_poses: FloatArray
    robot_velocities: FloatArray
    people_poses: FloatArray
    people_velocities: FloatArray
    scores: FloatArray
    outcome: Outcome | None

    def __len__(self) -> int:
        return len(self.scores)

    @cached_property
    def person_distances(self) -> FloatArray:
        """(n,) [m] to the closest person, centre; inf in a room without people."""
        offsets = self.people_poses[1:, :, :2] - self.robot_poses[1:, None, :2]
        return np.asarray(np.hypot(offsets[..., 0], offsets[..., 1]).min(axis=1, initial=np.inf))

    @cached_property
    def person_clearances(self) -> FloatArray:
        """(n,) [m] to the closest person, between surfaces; inf in a room without people."""
        return self.person_distances - self.robot_radius - self.people_radius

    @cached_property
    def speeds(self) -> FloatArray:
        """(n,) [m/s] of the robot."""
        return np.asarray(np.hypot(self.robot_velocities[1:, 0], self.robot_velocities[1:, 1]))

    @cached_property
    def goal_distances(self) -> FloatArray:
        """(n + 1,) [m] from the robot's centre to the goal, as the crow flies."""
        offsets = self.robot_poses[:, :2] - self.layout.goal
        return np.asarray(np.hypot(offsets[:, 0], offsets[:, 1]))


class TrajectoryRecorder:
    """Writes down an episode while it happens: its start when made, then one row a step.

    max_steps: the longest the episode can get
    """

    def __init__(self, world: World, control_period: float, max_steps: int) -> None:
        num_people = world.layout.num_people
        self._world = world
        self._control_period = control_period
        self._robot_poses = np.empty((max_steps + 1, 3))
        self._robot_velocities = np.empty((max_steps + 1, 3))
        self._people_poses = np.empty((max_steps + 1, num_people, 3))
        self._people_velocities = np.empty((max_steps + 1, num_people, 3))
        self._scores = np.full((max_steps, 2), np.nan)
        self._steps = 0
        self._write_state()

    def __len__(self) -> int:
        return self._steps

    def record(self, scores: Scores | None) -> None:
        """Write down the state that a step has led to, and how it was judged."""
        if scores is not None:
            self._scores[self._steps] = scores
        self._steps += 1
        self._write_state()

    @property
    def robot_poses(self) -> FloatArray:
        """(steps + 1, 3) since the start, not to be written to."""
        return self._robot_poses[: self._steps + 1]

    def trajectory(self, outcome: Outcome | None) -> Trajectory:
        """Everything recorded so far, independent of what is recorded later."""
        rows = self._steps + 1
        return Trajectory(
            layout=self._world.layout,
            control_period=self._control_period,
            robot_radius=self._world.robot_radius,
            people_radius=self._world.people_radius,
            robot_poses=self._robot_poses[:rows].copy(),
            robot_velocities=self._robot_velocities[:rows].copy(),
            people_poses=self._people_poses[:rows].copy(),
            people_velocities=self._people_velocities[:rows].copy(),
            scores=self._scores[: self._steps].copy(),
            outcome=outcome,
        )

    def _write_state(self) -> None:
        row, world = self._steps, self._world
        self._robot_poses[row] = world.robot_pose
        self._robot_velocities[row] = world.robot_velocity
        self._people_poses[row] = world.people_poses
        self._people_velocities[row] = world.people_velocities
