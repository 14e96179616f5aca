"""The simulated world of one episode: a robot and people who walk, kept apart by pymunk's physics.

World frame: SI units, REP-103.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from reward_model.jit import njit
from socnav_env.config import EnvConfig
from socnav_env.frames import pose_rates
from socnav_env.geometry import box_distances, boxes_of, wall_distances
from socnav_env.layout import BoolArray, FloatArray, IntArray, Layout, Script
from socnav_env.motors import STANDING, Motion, Motors, approach
from socnav_env.pedestrians import anyone_needs_target, first_in_sight, walk
from socnav_env.people_config import ORCA, STAND
from socnav_env.physics import Bodies, Physics, physics_step
from socnav_env.routes import Routes
from socnav_env.walkers import Habits, Surroundings, Walkers, habits_of, in_need_of_target, walkers_of

if TYPE_CHECKING:
    from socnav_env.orca import OrcaWalk

TARGET_CANDIDATES = 32
TARGET_SPREAD = 0.25  # share of the interval between targets by which it varies
MIN_WALK = 1.0  # m to a new target, at least


@dataclass(frozen=True)
class Contacts:
    """What the robot touched during the last control period."""

    person: bool = False
    object: bool = False
    wall: bool = False

    def __bool__(self) -> bool:
        return self.person or self.object or self.wall


class World:
    """One episode's world; it begins `config.warm_up` seconds before the episode.

    While the time is negative everyone gives way to the robot, which then stands, whatever `robot_visibility`
    says: nobody can walk into it before it may act. A scenario's script tells what happened then instead.

    Arrays that a world returns are copies.

    random_state: of the generator when the world was made; with the layout and the configuration it says
        everything about the world to come
    """

    def __init__(self, layout: Layout, config: EnvConfig, rng: np.random.Generator):
        self.layout, self.config, self._rng = layout, config, rng
        self.random_state = rng.bit_generator.state
        self._periods = -config.warm_up_steps
        self._walks = layout.people_walk & (config.people.model != STAND)
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
        self._command = STANDING
        self._motors = Motors(config.robot)
        self._touched = self._physics.bodies.touched
        self._walkers = walkers_of(
            layout.people_poses[self._walks], layout.people_group[self._walks], config.people, rng
        )
        self._orca = self._orca_walk()
        self._physics.fill(self._walkers.group, self._around)
        self._routes: Routes | None = None
        self._read()
        if layout.script is not None:
            self._take_up(layout.script)

    def advance(self, command: FloatArray) -> None:
        """Simulate one control period.

        command: (3,) forward speed [m/s], speed to the left [m/s] and turn rate [rad/s] of the robot. It stops for
        the rest of the period where it touches something.
        """
        if self.layout.script is not None and self._periods < 0:
            self._recall(self.layout.script)
            return
        self._command = float(command[0]), float(command[1]), float(command[2])
        self._motors.command(self._command, self._rng)
        self._before[:] = self._bodies[:, :3]
        self._touched[:] = False
        people = self.config.people
        if self._routes is not None:
            self._routes.follow(self._walkers, self._bodies, self.time)
        if anyone_needs_target(self._walkers.time_left, self._walkers.blocked, people.patience):
            self._pick_targets(in_need_of_target(self._walkers, people.patience))
        notice = 1.0 if self._periods < 0 else people.robot_visibility
        self._simulate(notice)
        self._periods += 1
        self._read()

    @property
    def time(self) -> float:
        """Since the episode began; negative during the warm-up [s]."""
        return self._periods * self.config.control_period

    @property
    def command(self) -> FloatArray:
        """What the robot was last told: (3,) forward [m/s], to the left [m/s], turn rate [rad/s]."""
        return np.array(self._command)

    @property
    def robot_radius(self) -> float:
        """[m]."""
        return self.config.robot.radius

    @property
    def people_radius(self) -> float:
        """[m]."""
        return self.config.people.radius

    @property
    def robot_pose(self) -> FloatArray:
        """(3,) x [m], y [m], heading [rad] from -pi to pi."""
        return self._robot_pose.copy()

    @property
    def robot_velocity(self) -> FloatArray:
        """(3,) vx, vy [m/s] in the world frame and turn rate [rad/s]: the mean over the last control period."""
        return self._robot_velocity.copy()

    @property
    def people_poses(self) -> FloatArray:
        """(num_people, 3) x [m], y [m], heading [rad] from -pi to pi."""
        return self._people_poses.copy()

    @property
    def people_velocities(self) -> FloatArray:
        """(num_people, 3) vx, vy [m/s] in the world frame, turn rate [rad/s]: means over the last control period."""
        return self._people_velocities.copy()

    @property
    def people_targets(self) -> FloatArray:
        """(num_people, 2) where people walk to; those who stand have their own place [m]."""
        targets = self.layout.people_poses[:, :2].copy()
        targets[self._walker_rows] = self._walkers.target
        return targets

    @property
    def contacts(self) -> Contacts:
        """What the robot touched during the last control period."""
        _, _, person, obstacle, wall = self._touched.tolist()
        return Contacts(person, obstacle, wall)

    def clearance_to_people(self) -> FloatArray:
        """(num_people,) from the robot's surface to each person's; negative where they overlap [m]."""
        apart = self.people_poses[:, :2] - self._bodies[-1, :2]
        clearance: FloatArray = np.hypot(apart[:, 0], apart[:, 1]) - self.robot_radius - self.people_radius
        return clearance

    def clearance_to_objects(self) -> FloatArray:
        """(num_objects,) from the robot's surface to each object's; negative where they overlap [m]."""
        x, y = self._bodies[-1, :2]
        return box_distances(x, y, self._boxes) - self.robot_radius

    def clearance_to_walls(self) -> FloatArray:
        """(num_walls,) from the robot's surface to each wall; negative where they overlap [m]."""
        x, y = self._bodies[-1, :2]
        return wall_distances(x, y, self._walls) - self.robot_radius

    def obstacles(self) -> Surroundings:
        """Everything that stops a ray: walls, people as discs, and objects as boxes; not to be written to."""
        discs = self._people_poses.copy()
        discs[:, 2] = self.people_radius
        return Surroundings(self._walls, discs, self._boxes)

    def distance_to_goal(self) -> float:
        """From the robot's centre [m]."""
        return math.dist(self._robot_pose[:2].tolist(), self.layout.goal.tolist())

    def arrived(self) -> bool:
        """Whether the robot's centre is within the arrival radius of the goal."""
        return self.distance_to_goal() < self.config.robot.arrival_radius

    def _read(self) -> None:
        """Note poses and velocities as they are after a control period: they are asked for many times."""
        standing, period = self.layout.people_poses, self.config.control_period
        state = _state_of(self._bodies, self._before, self._walker_rows, standing, period)
        self._robot_pose, self._robot_velocity, self._people_poses, self._people_velocities = state

    def _take_up(self, script: Script) -> None:
        """Begin where a scenario's warm-up begins; bodies are where they will be when the episode does."""
        self._routes = Routes(script, self._walks)
        self._bodies[:-1, 3:6] = script.velocities[self._walks]
        speeds = script.speeds[self._walks]
        self._walkers.speed[:] = np.where(np.isnan(speeds), self._walkers.speed, speeds)
        self._robot_velocity, self._people_velocities = np.zeros(3), script.velocities.copy()
        self._robot_pose, self._people_poses = script.robot_poses[0].copy(), script.people_poses[0].copy()

    def _recall(self, script: Script) -> None:
        """Let a control period of the warm-up pass as the script tells it."""
        row, period = self._periods + self.config.warm_up_steps, self.config.control_period
        self._periods += 1
        forward, left, turn_rate = script.commands[row].tolist()
        self._command = forward, left, turn_rate
        self._motors.resume(self._command)
        robot, people = script.robot_poses[row : row + 2], script.people_poses[row : row + 2]
        self._robot_pose, self._people_poses = robot[1].copy(), people[1].copy()
        self._robot_velocity = pose_rates(robot[:1], robot[1:], period)[0]
        self._people_velocities = pose_rates(people[0], people[1], period)

    def _simulate(self, notice: float) -> None:
        """Take the physics steps of a control period; `notice`: 0..1, of the robot by people."""
        count, step = self.config.substeps, self.config.physics_step
        stop_distance = notice * self.config.people.stop_distance
        bodies, motion, walkers = self._physics.bodies, self._motors.motion, self._walkers
        if self._orca is None:
            _simulate(count, step, bodies, motion, walkers, stop_distance, notice, self._around, self._habits)
            return
        for _ in range(count):
            self._orca.walk(step, bodies.states, walkers, stop_distance, notice, self._habits, bodies.velocities)
            _move(step, bodies, motion)

    def _orca_walk(self) -> OrcaWalk | None:
        if self.config.people.model != ORCA:
            return None
        from socnav_env.orca import OrcaWalk  # loads an optional package

        config = self.config
        return OrcaWalk(config.people, config.robot.radius, self._around, len(self._walker_rows), config.physics_step)

    def _surroundings(self) -> Surroundings:
        standing = self.layout.people_poses[~self._walks]
        discs = standing.copy()
        discs[:, 2] = self.config.people.radius
        return Surroundings(self._walls, discs, self._boxes)

    def _pick_targets(self, needed: BoolArray) -> None:
        """Give new targets to the groups of those who need one; whoever finds none waits and looks again."""
        walkers, people = self._walkers, self.config.people
        for group in np.unique(walkers.group[needed]):
            members = walkers.group == group
            spread = walkers.spacing[members][0] * (members.sum() - 1) / 2
            target = self._sample_target(self._bodies[:-1, :2][members].mean(axis=0), people.clearance + spread)
            walkers.blocked[members] = 0.0
            if target is None:
                walkers.time_left[members] = people.patience
                continue
            walkers.target[members] = target
            interval = people.target_interval * self._rng.uniform(1 - TARGET_SPREAD, 1 + TARGET_SPREAD)
            walkers.time_left[members] = interval

    def _sample_target(self, start: FloatArray, margin: float) -> FloatArray | None:
        """A free place in sight of `start` and off the goal; None where none was found."""
        lower, upper = self.layout.room.corners.min(axis=0), self.layout.room.corners.max(axis=0)
        places = self._rng.uniform(lower, upper, (TARGET_CANDIDATES, 2))
        far = np.hypot(*(places - start).T) >= MIN_WALK
        off_goal = np.hypot(*(places - self.layout.goal).T) >= self.config.people.clearance + self.robot_radius
        places = places[far & off_goal]
        index = first_in_sight(start, places, margin, *self._around)
        return places[index] if index >= 0 else None


@njit
def _simulate(
    count: int,
    step: float,
    bodies: Bodies,
    motion: Motion,
    walkers: Walkers,
    stop_distance: float,
    notice: float,
    around: Surroundings,
    habits: Habits,
) -> None:
    """Take so many physics steps of so many seconds; see `walk` for what is needed of people."""
    for _ in range(count):
        walk(step, bodies.states, walkers, stop_distance, notice, around, habits, bodies.velocities)
        _move(step, bodies, motion)


@njit
def _move(step: float, bodies: Bodies, motion: Motion) -> None:
    """Take a physics step, the robot as its motors drive it and people as they walk."""
    _drive(step, bodies, motion)
    physics_step(bodies, step)


@njit
def _drive(step: float, bodies: Bodies, motion: Motion) -> None:
    """Set the robot's velocity: along the heading that it has halfway through the step, none once it touches."""
    if bodies.touched.any():
        motion.velocity[:] = 0.0
        bodies.velocities[-1] = 0.0
        return
    approach(motion, step)
    forward, left, turn_rate = motion.velocity
    heading = bodies.states[-1, 2] + turn_rate * step / 2
    cosine, sine = math.cos(heading), math.sin(heading)
    velocity = bodies.velocities[-1]
    velocity[0], velocity[1], velocity[2] = forward * cosine - left * sine, forward * sine + left * cosine, turn_rate


@njit
def _state_of(
    bodies: FloatArray, before: FloatArray, walkers: IntArray, standing: FloatArray, period: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """The robot's pose and velocity, (3,), and people's, (num_people, 3).

    bodies: (num_walkers + 1, 6) as pymunk has them, the robot last; before: (num_walkers + 1, 3) a period ago
    walkers: (num_walkers,) which people walk; standing: (num_people, 3) where the others are
    """
    poses, velocities = standing.copy(), np.zeros_like(standing)
    for row in range(len(walkers)):
        poses[walkers[row]] = bodies[row, :3]
        velocities[walkers[row]] = (bodies[row, :3] - before[row]) / period
        poses[walkers[row], 2] -= 2 * math.pi * np.rint(bodies[row, 2] / (2 * math.pi))
    pose, velocity = bodies[-1, :3].copy(), (bodies[-1, :3] - before[-1]) / period
    pose[2] -= 2 * math.pi * np.rint(pose[2] / (2 * math.pi))
    return pose, velocity, poses, velocities
