"""Random initial layouts of people and objects, as SONATA makes them."""

from __future__ import annotations

import math
from collections import Counter
from itertools import combinations, pairwise

import numpy as np

from reward_model.base.angles import wrap_heading
from reward_model.base.arrays import FloatArray
from socnav_env.config import (
    AT_LAPTOP,
    AT_PLANT,
    TALKING,
    WALKING_TOGETHER,
    EnvConfig,
    RobotConfig,
)
from socnav_env.config.checks import ConfigError
from socnav_env.config.people import STAND
from socnav_env.geometry.distances import boxes_of, first_free, first_free_pair
from socnav_env.layout import Layout, ObjectKind, Room
from socnav_env.scenes.circles import circle_poses, circle_radius
from socnav_env.scenes.counts import Counts, draw_counts
from socnav_env.scenes.rooms import CELL, is_reachable, sample_room

CANDIDATES = 64  # places tried for each entity before the population is drawn anew
ROBOT_TRIES = 8  # starts and goals tried
SIGHT = 0.1  # m of free space on both sides of the line between two who interact


class _NoPlaceError(Exception):
    """No free place was found for the entity named in the message."""


def sample_layout(config: EnvConfig, rng: np.random.Generator) -> Layout:
    """Draw a room, then people, objects, goal and robot without overlap, the goal within the robot's reach.

    A population that does not fit is drawn anew, by default with new counts, so that small rooms hold fewer people and
    objects than large ones. The room stays, so that each kind keeps its share.

    Raises:
        ConfigError: Naming the room and the entity without a place, after `population.max_tries` populations.
    """
    room = sample_room(config.room, rng)
    failures: Counter[str] = Counter()
    counts = draw_counts(config.population, rng)
    for attempt in range(config.population.max_tries):
        if attempt > 0 and config.population.redraw_counts:
            counts = draw_counts(config.population, rng)
        try:
            return _Draft(room, config, rng).populate(counts)
        except _NoPlaceError as failure:
            failures[str(failure)] += 1
    what, _count = failures.most_common(1)[0]
    width, depth = np.ptp(room.corners, axis=0)
    raise ConfigError(
        f"population: {what} found no place in a {width:g} x {depth:g} m room with {len(room.corners)} corners in "
        f"{config.population.max_tries} tries; ask for fewer or for larger rooms"
    )


class _Draft:
    """A layout under construction; each part is placed clear of the parts placed before."""

    def __init__(self, room: Room, config: EnvConfig, rng: np.random.Generator):
        self.room, self.config, self.rng = room, config, rng
        self.walls = room.walls
        self.lower, self.extent = room.corners.min(axis=0), np.ptp(room.corners, axis=0)
        self.discs = np.empty((config.population.max_people + 1, 3))
        self.boxes = np.empty((config.population.max_objects, 6))
        self.num_discs = self.num_boxes = 0
        self.spaces: list[tuple[float, float, float]] = []  # x, y, radius of the circles of people who talk
        self.people: list[tuple[float, float, float]] = []
        self.walk: list[bool] = []
        self.group: list[int] = []
        self.objects: list[tuple[float, float, float]] = []
        self.sizes: list[tuple[float, float]] = []
        self.kinds: list[ObjectKind] = []
        self.interactions: list[tuple[str, int, int]] = []  # relation, person, other person or object

    def populate(self, counts: Counts) -> Layout:
        """Place everything, the largest first."""
        for size in counts.circles:
            self._place_circle(size)
        for size in counts.walking_groups:
            self._place_walking_group(size)
        for _ in range(counts.tables):
            self._place_table()
        for _ in range(counts.plants):
            self._place_plant()
        for relation in sorted(counts.relations, key=_PLACING_ORDER.index):
            _PLACING[relation](self)
        for _ in range(counts.still):
            self._place_person(walks=False)
        for _ in range(counts.wandering):
            self._place_person(walks=True)
        robot_pose, goal = self._robot_and_goal()
        return self._layout(robot_pose, goal)

    def _layout(self, robot_pose: FloatArray, goal: FloatArray) -> Layout:
        num_people = len(self.people)
        pairs = [
            (person, other + num_people * (relation in (AT_LAPTOP, AT_PLANT)))
            for relation, person, other in self.interactions
        ]
        return Layout(
            room=self.room,
            robot_pose=robot_pose,
            goal=goal,
            people_poses=np.array(self.people, dtype=np.float64).reshape(-1, 3),
            people_walk=np.array(self.walk, dtype=np.bool_),
            people_group=np.array(self.group, dtype=np.int64),
            object_poses=np.array(self.objects, dtype=np.float64).reshape(-1, 3),
            object_sizes=np.array(self.sizes, dtype=np.float64).reshape(-1, 2),
            object_kinds=np.array(self.kinds, dtype=np.int64),
            interaction_pairs=np.array(pairs, dtype=np.int64).reshape(-1, 2),
            interaction_relations=tuple(relation for relation, _, _ in self.interactions),
        )

    def _anywhere(self) -> FloatArray:
        """Random candidate places, (CANDIDATES, 2)."""
        places: FloatArray = self.lower + self.extent * self.rng.random((CANDIDATES, 2))
        return places

    def _heading(self) -> float:
        return float(self.rng.uniform(-math.pi, math.pi))

    def _obstacles(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        discs = self.discs[: self.num_discs]
        if self.spaces:
            discs = np.vstack([discs, self.spaces])
        return self.walls, discs, self.boxes[: self.num_boxes]

    def _free_place(self, margin: float, what: str) -> FloatArray:
        places = self._anywhere()
        index = first_free(places, margin, *self._obstacles())
        if index < 0:
            raise _NoPlaceError(what)
        place: FloatArray = places[index]
        return place

    def _free_pair(
        self, distances: tuple[float, float], margins: tuple[float, float], what: str, sight: float = SIGHT
    ) -> tuple[FloatArray, FloatArray]:
        """Two free places at a distance in `distances` [m], nothing within `sight` [m] of the line between them."""
        firsts = self._anywhere()
        apart = self.rng.uniform(*distances, CANDIDATES)
        direction = self.rng.uniform(-math.pi, math.pi, CANDIDATES)
        seconds = firsts + apart[:, None] * np.column_stack([np.cos(direction), np.sin(direction)])
        index = first_free_pair(firsts, seconds, *margins, sight, *self._obstacles())
        if index < 0:
            raise _NoPlaceError(what)
        return firsts[index], seconds[index]

    def _add_person(self, place: FloatArray, heading: float, walks: bool = False, group: int = -1) -> int:
        self.discs[self.num_discs] = place[0], place[1], self.config.people.clearance
        self.num_discs += 1
        self.people.append((float(place[0]), float(place[1]), heading))
        self.walk.append(walks)
        self.group.append(group)
        return len(self.people) - 1

    def _add_object(self, place: FloatArray, size: tuple[float, float], *kinds: ObjectKind) -> int:
        """Add objects of several kinds at one place; returns the index of the last one."""
        pose = (float(place[0]), float(place[1]), self._heading())
        for kind in kinds:
            self.objects.append(pose)
            self.sizes.append(size)
            self.kinds.append(kind)
        self.boxes[self.num_boxes] = boxes_of(np.array([pose]), np.array([size]))[0]
        self.num_boxes += 1
        return len(self.objects) - 1

    def _table_size(self) -> tuple[float, float]:
        sizes = self.config.population.table_sizes
        return sizes[int(self.rng.integers(len(sizes)))]

    def _place_table(self) -> None:
        size = self._table_size()
        self._add_object(self._free_place(_reach(size), "a table"), size, ObjectKind.TABLE, ObjectKind.LAPTOP)

    def _place_plant(self) -> None:
        size = self.config.population.plant_size
        self._add_object(self._free_place(_reach(size), "a plant"), size, ObjectKind.PLANT)

    def _place_person(self, walks: bool) -> None:
        what = "a person who walks" if walks else "a person who stands"
        self._add_person(self._free_place(self.config.people.clearance, what), self._heading(), walks)

    def _place_watcher(
        self, relation: str, size: tuple[float, float], kinds: tuple[ObjectKind, ...], what: str
    ) -> None:
        """Place a person in front of an object, facing it."""
        margins = (_reach(size), self.config.people.clearance)
        distances = self.config.population.watching_distance
        place, person = self._free_pair(distances, margins, what)
        thing = self._add_object(place, size, *kinds)
        watcher = self._add_person(person, _direction(person, place))
        self.interactions.append((relation, watcher, thing))

    def _place_at_laptop(self) -> None:
        kinds = (ObjectKind.TABLE, ObjectKind.LAPTOP)
        self._place_watcher(AT_LAPTOP, self._table_size(), kinds, "a person at a laptop")

    def _place_at_plant(self) -> None:
        size = self.config.population.plant_size
        self._place_watcher(AT_PLANT, size, (ObjectKind.PLANT,), "a person at a plant")

    def _place_talkers(self) -> None:
        clearance, angle = self.config.people.clearance, self.config.population.talking_angle
        distances = self.config.population.talking_distance
        first, second = self._free_pair(distances, (clearance, clearance), "two people who talk")
        askew = self.rng.uniform(-angle, angle, 2)
        one = self._add_person(first, wrap_heading(_direction(first, second) + askew[0]))
        other = self._add_person(second, wrap_heading(_direction(second, first) + askew[1]))
        self.interactions.append((TALKING, one, other))

    def _place_circle(self, size: int) -> None:
        """Place people in a circle with nothing inside: an F-formation (Kendon 1990) around its o-space."""
        spacing = float(self.rng.uniform(*self.config.population.circle_spacing))
        radius = circle_radius(size, spacing)
        middle = self._free_place(radius + self.config.people.clearance, f"a circle of {size}")
        poses = circle_poses(middle, radius, size, self._heading())
        self.spaces.append((float(middle[0]), float(middle[1]), radius))
        members = [self._add_person(pose[:2], float(pose[2])) for pose in poses]
        self.interactions += [(TALKING, *pair) for pair in combinations(members, 2)]

    def _place_walking_group(self, size: int) -> None:
        """Place people abreast, at equal distances."""
        spacing = float(self.rng.uniform(*self.config.population.couple_distance))
        width, clearance = (size - 1) * spacing, self.config.people.clearance
        what = f"a walking group of {size}"
        left, right = self._free_pair((width, width), (clearance, clearance), what, sight=clearance)
        heading = wrap_heading(_direction(right, left) - math.pi / 2)
        group = max(self.group, default=-1) + 1
        members = [
            self._add_person(left + share * (right - left), heading, walks=True, group=group)
            for share in np.linspace(0.0, 1.0, size)
        ]
        self.interactions += [(WALKING_TOGETHER, *pair) for pair in pairwise(members)]

    def _place_couple(self) -> None:
        clearance = self.config.people.clearance
        distances = self.config.population.couple_distance
        left, right = self._free_pair(distances, (clearance, clearance), "a couple")
        heading = wrap_heading(_direction(right, left) - math.pi / 2)
        group = max(self.group, default=-1) + 1
        one = self._add_person(left, heading, walks=True, group=group)
        other = self._add_person(right, heading, walks=True, group=group)
        self.interactions.append((WALKING_TOGETHER, one, other))

    def _robot_and_goal(self) -> tuple[FloatArray, FloatArray]:
        robot = self.config.robot
        margin = max(self.config.people.clearance, robot.radius + CELL / 2)
        for _ in range(ROBOT_TRIES):
            goal = self._free_place(margin, "the goal")
            start = self._free_place(margin, "the robot")
            if self._is_way(start, goal, robot):
                return np.array([start[0], start[1], self._heading()]), goal
        raise _NoPlaceError(f"a goal within the robot's reach and {robot.min_goal_distance:g} m away")

    def _is_way(self, start: FloatArray, goal: FloatArray, robot: RobotConfig) -> bool:
        """Whether start and goal are far enough apart, and the robot can reach the goal past those who stand."""
        if math.dist(start, goal) < robot.min_goal_distance:
            return False
        discs, boxes = self.discs[: self.num_discs], self.boxes[: self.num_boxes]
        walks = np.array(self.walk, dtype=np.bool_) & (self.config.people.model != STAND)
        standing = discs[~walks]
        standing[:, 2] = self.config.people.radius
        return is_reachable(start, goal, robot.arrival_radius, robot.radius, self.walls, standing, boxes)


_PLACING = {
    AT_LAPTOP: _Draft._place_at_laptop,
    AT_PLANT: _Draft._place_at_plant,
    TALKING: _Draft._place_talkers,
    WALKING_TOGETHER: _Draft._place_couple,
}
_PLACING_ORDER = tuple(_PLACING)  # objects first, so that none is placed between two who talk


def _reach(size: tuple[float, float]) -> float:
    """Radius of the circle around a box [m]."""
    return math.hypot(*size) / 2


def _direction(origin: FloatArray, towards: FloatArray) -> float:
    return math.atan2(towards[1] - origin[1], towards[0] - origin[0])
