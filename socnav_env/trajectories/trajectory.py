"""A recorded episode as plain arrays, one row per step, for metrics and replays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from reward_model.base.arrays import FloatArray, IntArray
from socnav_env.layout import Layout
from socnav_env.people.interactions import NO_CHANGES, InteractionHistory, history_of
from socnav_env.trajectories.outcomes import Outcome

if TYPE_CHECKING:
    from reward_model.scenes.scene import Scores
    from socnav_env.config import EnvConfig
    from socnav_env.simulation.world import World


NOT_SCORED = (np.nan, np.nan)


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A recorded episode of n steps in the world frame. Row 0 is its start, row k the state after step k.

    Unknown values are NaN: a person who is out of sight, a missing score.

    Attributes:
        layout: the room, the objects, the goal and the interactions
        times: (n + 1,) [s]
        robot_radius, people_radius: [m]
        top_speed: [m/s] of the robot
        robot_poses: (n + 1, 3)
        robot_velocities: (n + 1, 3) over ground, means over the step that led to a row
        people_poses: (n + 1, num_people, 3)
        people_velocities: (n + 1, num_people, 3) likewise
        people_targets: (n + 1, num_people, 2) [m] targets of walking people during the step
        commands: (n, 3) the robot's command in each step: forward [m/s], to the left [m/s] and turn rate [rad/s]
        scores: (n, 2) q1 and q2 after each step
        interaction_changes: (num_changes, 4) in order: the first row with the change, two people, lower index first,
            and whether they have begun (1) or ended (0) to talk with each other; row 0: before the start
        outcome: None if it is unknown, or if the episode was broken off
    """

    layout: Layout
    times: FloatArray
    robot_radius: float
    people_radius: float
    top_speed: float
    robot_poses: FloatArray
    robot_velocities: FloatArray
    people_poses: FloatArray
    people_velocities: FloatArray
    people_targets: FloatArray
    commands: FloatArray
    scores: FloatArray
    outcome: Outcome | None
    interaction_changes: IntArray = field(default_factory=NO_CHANGES.copy)

    def __len__(self) -> int:
        return len(self.scores)

    @cached_property
    def interactions(self) -> InteractionHistory:
        """The interactions at every row."""
        return history_of(self.layout, self.interaction_changes, len(self) + 1)

    @cached_property
    def durations(self) -> FloatArray:
        """(n,) [s] duration of each step."""
        return np.diff(self.times)

    @cached_property
    def people_distances(self) -> FloatArray:
        """(n, num_people) [m] distance to each person, between centres."""
        offsets = self.people_poses[1:, :, :2] - self.robot_poses[1:, None, :2]
        return np.asarray(np.hypot(offsets[..., 0], offsets[..., 1]))

    @cached_property
    def person_distances(self) -> FloatArray:
        """(n,) [m] distance to the closest person, between centres; inf in a room without people."""
        return np.asarray(np.fmin.reduce(self.people_distances, axis=1, initial=np.inf))

    @cached_property
    def person_clearances(self) -> FloatArray:
        """(n,) [m] distance to the closest person, between surfaces; inf in a room without people."""
        return self.person_distances - self.robot_radius - self.people_radius

    @cached_property
    def speeds(self) -> FloatArray:
        """(n,) [m/s] speed of the robot."""
        return np.asarray(np.hypot(self.robot_velocities[1:, 0], self.robot_velocities[1:, 1]))

    @cached_property
    def goal_distances(self) -> FloatArray:
        """(n + 1,) [m] straight-line distance from the robot's centre to the goal."""
        offsets = self.robot_poses[:, :2] - self.layout.goal
        return np.asarray(np.hypot(offsets[:, 0], offsets[:, 1]))


class TrajectoryRecorder:
    """Records an episode while it runs: its start on construction, then one row per step."""

    def __init__(self, world: World, config: EnvConfig) -> None:
        self._world = world
        self._control_period = config.control_period
        self._top_speed = config.robot.top_speed
        self._states = [world.state]
        self._targets = [world.people_targets]
        self._commands: list[FloatArray] = []
        self._scores: list[tuple[float, float]] = []

    def __len__(self) -> int:
        return len(self._scores)

    def record(self, scores: Scores | None) -> None:
        """Record the state after a step, and its scores."""
        self._states.append(self._world.state)
        self._targets.append(self._world.people_targets)
        self._commands.append(self._world.command)
        self._scores.append(NOT_SCORED if scores is None else (scores.q1, scores.q2))

    def trajectory(self, outcome: Outcome | None) -> Trajectory:
        """The trajectory recorded so far, independent of later records."""
        steps = len(self)
        robot_poses, robot_velocities, people_poses, people_velocities = zip(*self._states, strict=True)
        return Trajectory(
            layout=self._world.layout,
            times=np.asarray(np.arange(steps + 1) * self._control_period),
            robot_radius=self._world.robot_radius,
            people_radius=self._world.people_radius,
            top_speed=self._top_speed,
            robot_poses=_stacked(robot_poses),
            robot_velocities=_stacked(robot_velocities),
            people_poses=_stacked(people_poses),
            people_velocities=_stacked(people_velocities),
            people_targets=_stacked(self._targets),
            commands=np.array(self._commands, dtype=np.float64).reshape(steps, 3),
            scores=np.array(self._scores, dtype=np.float64).reshape(steps, 2),
            outcome=outcome,
            interaction_changes=self._world.interaction_changes,
        )


def _stacked(rows: Sequence[FloatArray]) -> FloatArray:
    """(len(rows), ...) like `np.stack`, which takes several times as long."""
    return np.concatenate(rows).reshape(len(rows), *rows[0].shape)
