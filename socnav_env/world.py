"""The simulated world of one episode: a robot and people who walk, kept apart by pymunk's physics.

World frame: SI units, REP-103. Nothing but this module imports pymunk.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pymunk
import pymunk.batch

from reward_model.jit import njit
from socnav_env.config import EnvConfig
from socnav_env.frames import pose_rates
from socnav_env.geometry import box_distances, boxes_of, wall_distances
from socnav_env.layout import BoolArray, FloatArray, IntArray, Layout, Script
from socnav_env.motors import STANDING, Motors
from socnav_env.pedestrians import (
    Surroundings,
    anyone_needs_target,
    first_in_sight,
    habits_of,
    in_need_of_target,
    walk,
    walkers_of,
)
from socnav_env.routes import Routes

ROBOT, PERSON, OBJECT, WALL = 1, 2, 3, 4  # pymunk's collision types
BODY_MASS = 1.0  # kg, the robot's and everyone's: where bodies touch, both give way
SLOP = 0.001  # m by which bodies may overlap at rest
OVERLAP_KEPT = 0.3  # share of an overlap that is left after a physics step
TARGET_CANDIDATES = 32
TARGET_SPREAD = 0.25  # share of the interval between targets by which it varies
MIN_WALK = 1.0  # m to a new target, at least
READ = (
    pymunk.batch.BodyFields.POSITION
    | pymunk.batch.BodyFields.ANGLE
    | pymunk.batch.BodyFields.VELOCITY
    | pymunk.batch.BodyFields.ANGULAR_VELOCITY
)
WRITE = pymunk.batch.BodyFields.VELOCITY | pymunk.batch.BodyFields.ANGULAR_VELOCITY


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
        self._walks = layout.people_walk
        self._walls = layout.room.walls
        self._boxes = boxes_of(layout.object_poses, layout.object_sizes)
        self._around = self._surroundings()
        self._habits = habits_of(config.people)
        self._physics = _Physics(int(self._walks.sum()) + 1, config)
        self._bodies, self._velocities = self._physics.bodies, self._physics.velocities
        self._bodies[:-1, :3] = layout.people_poses[self._walks]
        self._bodies[-1, :3] = layout.robot_pose
        self._before = self._bodies[:, :3].copy()
        self._command = STANDING
        self._motors = Motors(config.robot)
        self._touched: set[int] = set()
        self._walkers = walkers_of(
            layout.people_poses[self._walks], layout.people_group[self._walks], config.people, rng
        )
        self._physics.fill(self._walkers.group, self._around)
        self._physics.report_touches(self._touched)
        self._walker_rows = np.flatnonzero(self._walks)
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
        self._touched.clear()
        people, step = self.config.people, self.config.physics_step
        if self._routes is not None:
            self._routes.follow(self._walkers, self._bodies, self.time)
        if anyone_needs_target(self._walkers.time_left, self._walkers.blocked, people.patience):
            self._pick_targets(in_need_of_target(self._walkers, people.patience))
        notice = 1.0 if self._periods < 0 else people.robot_visibility
        stop_distance = notice * people.stop_distance
        for _ in range(self.config.substeps):
            walk(
                step,
                self._bodies,
                self._walkers,
                stop_distance,
                notice,
                self._around,
                self._habits,
                self._velocities,
            )
            self._drive(step)
            self._physics.step(step)
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
        return Contacts(PERSON in self._touched, OBJECT in self._touched, WALL in self._touched)

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

    def _drive(self, step: float) -> None:
        """Write the robot's velocity: along the heading that it has halfway through the step."""
        if self._touched:
            self._motors.stop()
            self._velocities[-1] = STANDING
            return
        forward, left, turn_rate = self._motors.velocity(step)
        heading = float(self._bodies[-1, 2]) + turn_rate * step / 2
        cosine, sine = math.cos(heading), math.sin(heading)
        self._velocities[-1] = forward * cosine - left * sine, forward * sine + left * cosine, turn_rate

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


class _Physics:
    """The pymunk space: bodies for the robot and those who walk, fixed shapes for all else.

    bodies: (num_bodies, 6) x, y, heading, vx, vy, turn rate, the robot's last; read from pymunk after each step
    velocities: (num_bodies, 3) vx, vy, turn rate, written to pymunk before each step
    """

    def __init__(self, num_bodies: int, config: EnvConfig):
        self._config = config
        self._space = pymunk.Space()
        self._space.collision_slop = SLOP
        self._space.collision_bias = OVERLAP_KEPT ** (1 / config.physics_step)
        all_velocities = np.zeros((num_bodies + 1, 3))  # pymunk's last body is the one that is fixed
        self.bodies, self.velocities = np.zeros((num_bodies, 6)), all_velocities[:-1]
        self._read, self._write = pymunk.batch.Buffer(), pymunk.batch.Buffer()
        self._write.set_float_buf(all_velocities)  # shares the array's memory

    def fill(self, groups: IntArray, around: Surroundings) -> None:
        """Put the bodies in their places, and everything around them. groups: (num_walkers,)."""
        for row, group in zip(self.bodies[:-1], groups, strict=True):
            # People of one group walk shoulder to shoulder: they do not collide with each other.
            self._add_body(row, self._config.people.radius, PERSON, pymunk.ShapeFilter(group=int(group) + 1))
        self._add_body(self.bodies[-1], self._config.robot.radius, ROBOT, pymunk.ShapeFilter())
        self._add_fixed(around)

    def step(self, duration: float) -> None:
        """Set all velocities, simulate, and read back poses and velocities."""
        pymunk.batch.set_space_bodies(self._space, WRITE, self._write)
        self._space.step(duration)
        self._read.clear()
        pymunk.batch.get_space_bodies(self._space, READ, self._read)
        self.bodies[:] = np.frombuffer(self._read.float_buf(), count=self.bodies.size).reshape(self.bodies.shape)

    def report_touches(self, touched: set[int]) -> None:
        """Have the collision type of what the robot touches added to `touched` at each step."""
        for kind in (PERSON, OBJECT, WALL):
            self._space.on_collision(
                ROBOT, kind, post_solve=lambda _arbiter, _space, kind: touched.add(kind), data=kind
            )

    def _add_body(self, row: FloatArray, radius: float, kind: int, group: pymunk.ShapeFilter) -> None:
        body = pymunk.Body(BODY_MASS, math.inf)
        body.position = float(row[0]), float(row[1])
        body.angle = float(row[2])
        shape = pymunk.Circle(body, radius)
        shape.collision_type, shape.filter = kind, group
        self._space.add(body, shape)

    def _add_fixed(self, around: Surroundings) -> None:
        fixed = self._space.static_body
        for x1, y1, x2, y2 in around.walls.tolist():
            self._add_shape(pymunk.Segment(fixed, (x1, y1), (x2, y2), 0.0), WALL)
        for x, y, radius in around.discs.tolist():
            self._add_shape(pymunk.Circle(fixed, radius, (x, y)), PERSON)
        for box in around.boxes:
            self._add_shape(pymunk.Poly(fixed, _corners_of(box)), OBJECT)

    def _add_shape(self, shape: pymunk.Shape, kind: int) -> None:
        shape.collision_type = kind
        self._space.add(shape)


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


def _corners_of(box: FloatArray) -> list[tuple[float, float]]:
    x, y, cos, sin, half_width, half_depth = box.tolist()
    signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return [
        (x + cos * a * half_width - sin * b * half_depth, y + sin * a * half_width + cos * b * half_depth)
        for a, b in signs
    ]
