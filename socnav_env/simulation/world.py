"""The simulated world of one episode: a robot and walking people, kept apart by pymunk's physics.

World frame: SI units, REP-103.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reward_model.base.arrays import BoolArray, FloatArray, IntArray
from reward_model.base.numba import machine_code
from socnav_env.config import EnvConfig
from socnav_env.config.people import ORCA, STAND
from socnav_env.geometry.distances import box_distances, boxes_of, wall_distances
from socnav_env.geometry.frames import pose_rates
from socnav_env.layout import Layout, Script
from socnav_env.people.conversations import Conversations
from socnav_env.people.interactions import InteractionPairs, circles_of, interactions_of, talking
from socnav_env.people.routes import Routes
from socnav_env.people.social_force import anyone_needs_target
from socnav_env.people.walkers import Surroundings, habits_of, in_need_of_target, walkers_of
from socnav_env.people.wandering import pick_targets
from socnav_env.simulation.motors import Motors
from socnav_env.simulation.physics import Physics
from socnav_env.simulation.stepping import move, simulate, state_of

if TYPE_CHECKING:
    from socnav_env.people.orca import OrcaWalk


@dataclass(frozen=True)
class Contacts:
    """The robot's contacts during the last control period."""

    person: bool = False
    object: bool = False
    wall: bool = False

    def __bool__(self) -> bool:
        return self.person or self.object or self.wall


class WorldState(NamedTuple):
    """Poses at one moment and the mean velocities over the control period before it; read-only.

    Every moment has new arrays. See the properties of `World` with the same names.
    """

    robot_pose: FloatArray
    robot_velocity: FloatArray
    people_poses: FloatArray
    people_velocities: FloatArray


class World:
    """The world of one episode; it begins `config.warm_up` seconds before the episode.

    During the warm-up, while the time is negative, everyone gives way to the standing robot, whatever
    `robot_visibility` is, so that nobody walks into it before it can act. In a scenario the script gives the warm-up.

    Returned arrays are copies, except those of the state.

    state: the current poses and velocities, for frequent use

    random_state: of the generator when the world was created; with the layout, the configuration and the commands it
        determines the simulation
    """

    def __init__(self, layout: Layout, config: EnvConfig, rng: np.random.Generator):
        self.layout, self.config, self._rng = layout, config, rng
        self._interactions = interactions_of(layout)
        self.random_state = rng.bit_generator.state
        self._periods = -config.warm_up_steps
        self._walks = self._walker_mask()
        self._walker_rows = np.flatnonzero(self._walks)
        self._walls = layout.room.walls
        self._boxes = boxes_of(layout.object_poses, layout.object_sizes)
        self._around = self._surroundings()
        self._habits = habits_of(config.people)
        self._physics = Physics(int(self._walks.sum()), config)
        self._bodies = self._physics.bodies.states
        self._bodies[:-1, :3] = layout.people_poses[self._walks]
        self._bodies[-1, :3] = layout.robot_pose
        self._before = self._bodies[:, :3].copy()
        self._command = np.zeros(3)
        self._motors = Motors(config.robot)
        self._touched = self._physics.bodies.touched
        self._walkers = walkers_of(
            layout.people_poses[self._walks], layout.people_group[self._walks], config.people, rng
        )
        self._orca = self._orca_walk()
        arrays = self._physics.bodies, self._motors.motion, self._walkers
        self._stepping = machine_code(simulate, 0, 0.0, *arrays, 0.0, 0.0, self._around, self._habits)
        self._physics.fill(self._walkers.group, self._around)
        self._conversations = self._changing_conversations()
        self._routes: Routes | None = None
        self._read()
        if layout.script is not None:
            self._start_script(layout.script)

    def advance(self, command: FloatArray) -> None:
        """Simulate one control period.

        Args:
            command: (3,) forward speed [m/s], speed to the left [m/s] and turn rate [rad/s] of the robot. It stops for
                the rest of the period if it touches something.
        """
        if self.layout.script is not None and self._periods < 0:
            self._replay_script(self.layout.script)
            return
        self._command = np.array(command, dtype=np.float64)
        self._motors.command(self._command, self._rng)
        self._before[:] = self._bodies[:, :3]
        self._touched[:] = False
        people = self.config.people
        if self._routes is not None:
            self._routes.follow(self._walkers, self._bodies, self.time)
        if self._conversations is not None:
            row = max(self._periods + 1, 0)
            self._conversations.update(row, self._walkers, self._bodies, self._around, self._rng)
        if anyone_needs_target(self._walkers.time_left, self._walkers.blocked, people.patience):
            needed, places = in_need_of_target(self._walkers, people.patience), self._bodies[:-1, :2]
            pick_targets(needed, self._walkers, places, self.layout, self._target_obstacles(), self.config, self._rng)
        notice = 1.0 if self._periods < 0 else people.robot_visibility
        self._simulate(notice)
        self._periods += 1
        self._read()

    @property
    def time(self) -> float:
        """Time since the episode began [s]; negative during the warm-up."""
        return self._periods * self.config.control_period

    @property
    def command(self) -> FloatArray:
        """The robot's last command: (3,) forward [m/s], to the left [m/s], turn rate [rad/s]."""
        return self._command.copy()

    @property
    def robot_radius(self) -> float:
        """Radius of the robot [m]."""
        return self.config.robot.radius

    @property
    def people_radius(self) -> float:
        """Radius of people [m]."""
        return self.config.people.radius

    @property
    def robot_pose(self) -> FloatArray:
        """(3,) x [m], y [m], heading [rad] from -pi to pi."""
        return self.state.robot_pose.copy()

    @property
    def robot_velocity(self) -> FloatArray:
        """(3,) vx, vy [m/s] in the world frame and turn rate [rad/s]: the mean over the last control period."""
        return self.state.robot_velocity.copy()

    @property
    def people_poses(self) -> FloatArray:
        """(num_people, 3) x [m], y [m], heading [rad] from -pi to pi."""
        return self.state.people_poses.copy()

    @property
    def people_velocities(self) -> FloatArray:
        """(num_people, 3) vx, vy [m/s] in the world frame, turn rate [rad/s]: means over the last control period."""
        return self.state.people_velocities.copy()

    @property
    def people_targets(self) -> FloatArray:
        """(num_people, 2) targets of people [m]; for those who stand, their own position."""
        targets = self.layout.people_poses[:, :2].copy()
        targets[self._walker_rows] = self._walkers.target
        return targets

    @property
    def interactions(self) -> InteractionPairs:
        """The current interactions: the same object until they change, read-only."""
        return self._interactions if self._conversations is None else self._conversations.interactions

    @property
    def interaction_changes(self) -> IntArray:
        """(num_changes, 4) pairs that have begun or ended to talk; see `Trajectory`."""
        changes = [] if self._conversations is None else self._conversations.changes
        return np.array(changes, dtype=np.int64).reshape(-1, 4)

    @property
    def contacts(self) -> Contacts:
        """The robot's contacts during the last control period."""
        _, _, person, obstacle, wall = self._touched.tolist()
        return Contacts(person, obstacle, wall)

    def clearance_to_people(self) -> FloatArray:
        """(num_people,) distance from the robot's surface to each person's [m]; negative if they overlap."""
        apart = self.people_poses[:, :2] - self._bodies[-1, :2]
        clearance: FloatArray = np.hypot(apart[:, 0], apart[:, 1]) - self.robot_radius - self.people_radius
        return clearance

    def clearance_to_objects(self) -> FloatArray:
        """(num_objects,) distance from the robot's surface to each object's [m]; negative if they overlap."""
        x, y = self._bodies[-1, :2]
        return box_distances(x, y, self._boxes) - self.robot_radius

    def clearance_to_walls(self) -> FloatArray:
        """(num_walls,) distance from the robot's surface to each wall [m]; negative if they overlap."""
        x, y = self._bodies[-1, :2]
        return wall_distances(x, y, self._walls) - self.robot_radius

    def obstacles(self) -> Surroundings:
        """Everything that stops a ray: walls, people as discs, and objects as boxes; read-only."""
        discs = self.people_poses
        discs[:, 2] = self.people_radius
        return Surroundings(self._walls, discs, self._boxes)

    def distance_to_goal(self) -> float:
        """Distance from the robot's centre to the goal [m]."""
        return math.dist(self.state.robot_pose[:2].tolist(), self.layout.goal.tolist())

    def arrived(self) -> bool:
        """Whether the robot's centre is within the arrival radius of the goal."""
        return self.distance_to_goal() < self.config.robot.arrival_radius

    def _read(self) -> None:
        """Store poses and velocities after a control period, since they are read many times."""
        standing, period = self.layout.people_poses, self.config.control_period
        self.state = WorldState(*state_of(self._bodies, self._before, self._walker_rows, standing, period))

    def _start_script(self, script: Script) -> None:
        """Start with a scenario's warm-up; bodies already have their poses at the start of the episode."""
        self._routes = Routes(script, self._walks)
        self._bodies[:-1, 3:6] = script.velocities[self._walks]
        speeds = script.speeds[self._walks]
        self._walkers.speed[:] = np.where(np.isnan(speeds), self._walkers.speed, speeds)
        poses = script.robot_poses[0].copy(), script.people_poses[0].copy()
        self.state = WorldState(poses[0], np.zeros(3), poses[1], script.velocities.copy())

    def _replay_script(self, script: Script) -> None:
        """Advance by one control period of the warm-up in the script."""
        row, period = self._periods + self.config.warm_up_steps, self.config.control_period
        self._periods += 1
        self._command = script.commands[row].copy()
        self._motors.resume(self._command)
        robot, people = script.robot_poses[row : row + 2], script.people_poses[row : row + 2]
        velocities = pose_rates(robot[:1], robot[1:], period)[0], pose_rates(people[0], people[1], period)
        self.state = WorldState(robot[1].copy(), velocities[0], people[1].copy(), velocities[1])

    def _simulate(self, notice: float) -> None:
        """Simulate the physics steps of a control period; `notice`: 0..1, visibility of the robot to people."""
        count, step = self.config.substeps, self.config.physics_step
        stop_distance = notice * self.config.people.stop_distance
        bodies, motion, walkers = self._physics.bodies, self._motors.motion, self._walkers
        if self._orca is None:
            self._stepping(count, step, bodies, motion, walkers, stop_distance, notice, self._around, self._habits)
            return
        for _ in range(count):
            self._orca.walk(step, bodies.states, walkers, stop_distance, notice, self._habits, bodies.velocities)
            move(step, bodies, motion)

    def _orca_walk(self) -> OrcaWalk | None:
        if self.config.people.model != ORCA:
            return None
        from socnav_env.people.orca import OrcaWalk  # loads an optional package

        config = self.config
        return OrcaWalk(config.people, config.robot.radius, self._around, len(self._walker_rows), config.physics_step)

    def _walker_mask(self) -> BoolArray:
        if self.config.people.model == STAND:
            return np.zeros(self.layout.num_people, dtype=np.bool_)
        if self._conversations_change():
            return self.layout.people_walk | talking(self.layout)
        return self.layout.people_walk

    def _conversations_change(self) -> bool:
        """Whether people join and leave conversations; in a scenario they follow its script instead."""
        config = self.config
        return config.population.conversations.change and config.people.model != STAND and self.layout.script is None

    def _changing_conversations(self) -> Conversations | None:
        if not self._conversations_change():
            return None
        return Conversations(self.layout, self.config, self._walker_rows, self._walkers, self._bodies[:-1, :3])

    def _target_obstacles(self) -> Surroundings:
        """Obstacles to targets: everything that stands, and the space between three or more who talk."""
        discs = [self._around.discs, circles_of(self.interactions, self.state.people_poses)]
        if self._conversations is not None:
            talkers = self._bodies[self._conversations.talkers(), :3].copy()
            talkers[:, 2] = self.config.people.radius
            discs.append(talkers)
        return self._around._replace(discs=np.vstack(discs))

    def _surroundings(self) -> Surroundings:
        standing = self.layout.people_poses[~self._walks]
        discs = standing.copy()
        discs[:, 2] = self.config.people.radius
        return Surroundings(self._walls, discs, self._boxes)
