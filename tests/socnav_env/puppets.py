"""Stand-ins whose every answer a test sets by hand."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np

from reward_model.base.arrays import FloatArray
from socnav_env.layout import Layout, ObjectKind, Room
from socnav_env.people.interactions import NO_CHANGES, interactions_of
from socnav_env.simulation.world import WorldState

PEOPLE_RADIUS = 0.25  # m
ROBOT_RADIUS = 0.25  # m


def make_layout(**changes) -> Layout:
    """A 6 m square with two people who talk, a table with its laptop, and the goal 2 m before the robot."""
    values = {
        "room": Room(np.array([[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]])),
        "robot_pose": np.zeros(3),
        "goal": np.array([2.0, 0.0]),
        "people_poses": np.array([[1.0, 2.0, -np.pi / 2], [1.0, -1.0, np.pi / 2]]),
        "people_walk": np.array([False, True]),
        "people_group": np.array([-1, -1]),
        "object_poses": np.array([[-2.0, 0.0, 0.0], [-2.0, 0.0, 0.0]]),
        "object_sizes": np.array([[0.8, 0.6], [0.8, 0.6]]),
        "object_kinds": np.array([ObjectKind.TABLE, ObjectKind.LAPTOP]),
        "interaction_pairs": np.array([[0, 1]]),
        "interaction_relations": ("two_static_person_talking",),
    }
    return Layout(**{**values, **changes})


@dataclass
class PuppetWorld:
    """Answers what a `World` answers; `advance` moves the robot by the command and lets people be."""

    layout: Layout = field(default_factory=make_layout)
    time: float = 0.0
    control_period: float = 0.2
    people_radius: float = PEOPLE_RADIUS
    robot_radius: float = ROBOT_RADIUS

    def __post_init__(self) -> None:
        self.robot_pose = self.layout.robot_pose.copy()
        self.robot_velocity = np.zeros(3)
        self.command = np.zeros(3)
        self.interactions = interactions_of(self.layout)
        self.interaction_changes = NO_CHANGES
        self.people_poses = self.layout.people_poses.copy()
        self.people_velocities = np.zeros((self.layout.num_people, 3))
        self.people_targets = self.layout.people_poses[:, :2].copy()
        self.contacts = SimpleNamespace(person=False, object=False, wall=False)
        self.at_goal = False

    @property
    def state(self) -> WorldState:
        return WorldState(self.robot_pose, self.robot_velocity, self.people_poses.copy(), self.people_velocities.copy())

    def advance(self, command: FloatArray) -> None:
        forward, _, turn = command
        heading = self.robot_pose[2]
        self.command = command.copy()
        self.robot_velocity = np.array([forward * np.cos(heading), forward * np.sin(heading), turn])
        self.robot_pose = self.robot_pose + self.control_period * self.robot_velocity
        self.people_poses = self.people_poses + self.control_period * self.people_velocities
        self.time += self.control_period

    def clearance_to_people(self) -> FloatArray:
        offsets = self.people_poses[:, :2] - self.robot_pose[:2]
        return np.hypot(offsets[:, 0], offsets[:, 1]) - self.robot_radius - self.people_radius

    def distance_to_goal(self) -> float:
        return float(np.hypot(*(self.layout.goal - self.robot_pose[:2])))

    def arrived(self) -> bool:
        return self.at_goal
