"""Layouts drawn from a scenario file: ranges become numbers, names become indices, and nothing overlaps."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, TypeVar

import numpy as np

from reward_model.base.angles import wrap_heading
from reward_model.base.arrays import FloatArray, IntArray
from socnav_env.config import AT_LAPTOP, AT_PLANT, TALKING, WALKING_TOGETHER, EnvConfig
from socnav_env.config.checks import ConfigError
from socnav_env.layout import Layout, ObjectKind, Room
from socnav_env.people.walkers import sample_speeds
from socnav_env.scenarios.entries import (
    GOAL,
    ROBOT,
    STANDS,
    WALKS,
    Entity,
    InteractionEntry,
    ObjectEntry,
    PersonEntry,
    RoomEntry,
    SceneFile,
    Spot,
)
from socnav_env.scenarios.fields import Amount
from socnav_env.scenarios.floor import Floor, UnfitError, ordered_corners
from socnav_env.scenarios.scripts import Walk, write_script
from socnav_env.scenes.rooms import is_reachable

MAX_DRAWS: Final = 50  # draws of a whole scene until one fits
MAX_PLACES: Final = 64  # places tried for an entity without a fixed place
ELBOW_ROOM: Final = 0.05  # m between the robot and others at the start

Placed = TypeVar("Placed")


def draw_layout(scene: SceneFile, config: EnvConfig, rng: np.random.Generator) -> Layout:
    """Draw a scene for an episode. Raises `ConfigError` naming the reason where no draw fits."""
    reason = ""
    for _ in range(MAX_DRAWS):
        try:
            return _Drawing(scene, config, rng).layout()
        except UnfitError as failure:
            reason = str(failure)
    raise ConfigError(f"{scene.file}: {reason}")


@dataclass
class _Person:
    entry: PersonEntry
    place: FloatArray
    walk: Walk
    group: int = -1


@dataclass
class _Thing:
    """A drawn object entry; first: the index of its first object."""

    entry: ObjectEntry
    pose: FloatArray
    size: tuple[float, float]
    first: int

    @property
    def last(self) -> int:
        """The index of the object that people interact with: the laptop of a desk."""
        return self.first + len(self.entry.kinds) - 1


class _Drawing:
    """One draw of a scene; entities are placed one after the other, each clear of those before."""

    def __init__(self, scene: SceneFile, config: EnvConfig, rng: np.random.Generator) -> None:
        self.scene, self.config, self.rng = scene, config, rng
        self.room = Room(ordered_corners(_draw_corners(scene.room, rng)))
        self.floor = Floor(self.room)
        self.people: list[_Person] = []
        self.things: list[_Thing] = []
        self.places: dict[str, FloatArray] = {}  # places of named entities

    def layout(self) -> Layout:
        """Draw the layout. Raises `UnfitError` where something does not fit."""
        for thing in self.scene.objects:
            self._place_thing(thing)
        for person in self.scene.people:
            for _ in range(int(self.rng.integers(person.count[0], person.count[1] + 1))):
                self._place_person(person)
        self._join_companions()
        robot = self.config.robot
        goal = self._find(self.scene.goal, lambda place: self._round(self.scene.goal, place, robot.radius, False))
        margin = robot.radius + ELBOW_ROOM
        start = self._find(self.scene.robot, lambda place: self._round(self.scene.robot, place, margin, True))
        self.places |= {GOAL: goal, ROBOT: start}
        self._check_way(start, goal)
        return self._assemble(start, goal)

    def _find(self, entity: Entity, put: Callable[[FloatArray], Placed]) -> Placed:
        """Place an entity at the first drawn place where it fits. Raises `UnfitError` where there is none."""
        for attempt in range(MAX_PLACES):
            try:
                return put(self._draw_spot(entity.spot))
            except UnfitError:
                if entity.spot.is_fixed or attempt == MAX_PLACES - 1:
                    raise
        raise AssertionError("the last attempt raises")

    def _draw_spot(self, spot: Spot) -> FloatArray:
        place = np.array([spot.x.draw(self.rng), spot.y.draw(self.rng)])
        if spot.jitter:
            angle, share = self.rng.uniform(-math.pi, math.pi), math.sqrt(self.rng.random())
            place += spot.jitter * share * np.array([math.cos(angle), math.sin(angle)])
        return place

    def _round(self, entity: Entity, place: FloatArray, radius: float, among_people: bool) -> FloatArray:
        self.floor.require_room(place, radius, entity.words, among_people)
        return place

    def _place_thing(self, entry: ObjectEntry) -> None:
        size = entry.size[0].draw(self.rng), entry.size[1].draw(self.rng)
        assert isinstance(entry.heading, Amount), "objects look at nothing"
        heading = entry.heading.draw(self.rng)

        def put(place: FloatArray) -> FloatArray:
            pose = np.array([*place, wrap_heading(heading)])
            self.floor.add_box(pose, size, entry.words)
            return pose

        first = sum(len(thing.entry.kinds) for thing in self.things)
        self.things.append(_Thing(entry, self._find(entry, put), size, first))
        self.places[entry.name] = self.things[-1].pose[:2]

    def _place_person(self, entry: PersonEntry) -> None:
        radius = self.config.people.radius

        def put(place: FloatArray) -> FloatArray:
            self.floor.add_person(place, radius, entry.words)
            return place

        place = self._find(entry, put)
        speed = math.nan
        if entry.speed is not None:
            speed = entry.speed.draw(self.rng)
        elif entry.does == WALKS:
            speed = float(sample_speeds(self.config.people, 1, self.rng)[0])
        route = tuple(self._draw_stop(entry, index) for index in range(len(entry.route)))
        delay = entry.delay.draw(self.rng)
        walk = Walk(speed, entry.does == WALKS and delay == 0, route, delay, entry.ending)
        self.people.append(_Person(entry, place, walk))
        self.places[entry.name] = place

    def _draw_stop(self, entry: PersonEntry, index: int) -> tuple[float, float]:
        """Draw a place of a route."""
        place = self._draw_spot(entry.route[index])
        words = f"{entry.place}.route[{index}]"
        self.floor.require_room(place, self.config.people.radius, words, among_people=False)
        return float(place[0]), float(place[1])

    def _join_companions(self) -> None:
        """Give each companion the group and the walk of the person they walk beside."""
        for person in self.people:
            if person.entry.companion:
                leader = self.people[self._person_named(person.entry.companion)]
                leader.group = person.group = self._person_named(person.entry.companion)
                person.walk = leader.walk

    def _person_named(self, name: str) -> int:
        return next(index for index, person in enumerate(self.people) if person.entry.name == name)

    def _check_way(self, start: FloatArray, goal: FloatArray) -> None:
        robot = self.config.robot
        if math.dist(start, goal) <= robot.arrival_radius:
            raise UnfitError(f"robot.at must be farther than {robot.arrival_radius:g} m from the goal")
        standing = self.floor.people(np.array([person.entry.does == STANDS for person in self.people], dtype=np.bool_))
        walls, boxes = self.room.walls, self.floor.boxes
        if not is_reachable(start, goal, robot.arrival_radius, robot.radius, walls, standing, boxes):
            raise UnfitError("goal must be within the robot's reach, past all that stands")

    def _assemble(self, start: FloatArray, goal: FloatArray) -> Layout:
        links = [self._link(each) for each in self.scene.interactions]
        links += [
            (person.group, index, WALKING_TOGETHER)
            for index, person in enumerate(self.people)
            if person.entry.companion
        ]
        poses = np.array([[*person.place, 0.0] for person in self.people]).reshape(-1, 3)
        poses[:, 2] = [self._heading_of(index, links) for index in range(len(self.people))]
        robot_pose = np.array([*start, self._robot_heading(start)])
        objects = [(thing, kind) for thing in self.things for kind in thing.entry.kinds]
        return Layout(
            room=self.room,
            robot_pose=robot_pose,
            goal=goal,
            people_poses=poses,
            people_walk=np.array([person.entry.does != STANDS for person in self.people], dtype=np.bool_),
            people_group=self._groups(),
            object_poses=np.array([thing.pose for thing, _ in objects]).reshape(-1, 3),
            object_sizes=np.array([thing.size for thing, _ in objects]).reshape(-1, 2),
            object_kinds=np.array([kind for _, kind in objects], dtype=np.int64),
            interaction_pairs=np.array([link[:2] for link in links], dtype=np.int64).reshape(-1, 2),
            interaction_relations=tuple(relation for _, _, relation in links),
            script=write_script(robot_pose, poses, [person.walk for person in self.people], self.config, self.floor),
        )

    def _groups(self) -> IntArray:
        """Group number of each person, counted from 0; -1 for people on their own."""
        leaders = sorted({person.group for person in self.people} - {-1})
        return np.array([leaders.index(each.group) if each.group >= 0 else -1 for each in self.people], dtype=np.int64)

    def _link(self, interaction: InteractionEntry) -> tuple[int, int, str]:
        """A pair of entities, people first, and their relation."""
        people = [self._person_named(name) for name in interaction.between if self._is_person(name)]
        things = [each for each in self.things if each.entry.name in interaction.between]
        if not people:
            raise ConfigError(f"{self.scene.file}: {interaction.place}.between must name a person")
        if not things:
            both_walk = all(self.people[index].entry.does != STANDS for index in people)
            return people[0], people[1], interaction.relation or (WALKING_TOGETHER if both_walk else TALKING)
        at_plant = things[0].entry.kinds[-1] is ObjectKind.PLANT
        relation = interaction.relation or (AT_PLANT if at_plant else AT_LAPTOP)
        return people[0], len(self.people) + things[0].last, relation

    def _is_person(self, name: str) -> bool:
        return any(person.entry.name == name for person in self.people)

    def _heading_of(self, index: int, links: list[tuple[int, int, str]]) -> float:
        """A person's heading: as in the file, along their route, to a partner, or random."""
        person = self.people[index]
        if person.entry.heading is not None:
            return self._heading(person.entry.heading, person.place)
        if person.walk.route:
            middle = np.mean(
                [each.place for each in self.people if each.group == person.group >= 0] or [person.place], 0
            )
            return _direction(middle, np.array(person.walk.route[0]))
        for link in links:
            if index in link[:2]:
                other = link[1] if link[0] == index else link[0]
                return _direction(person.place, self._place_of(other))
        return float(self.rng.uniform(-math.pi, math.pi))

    def _place_of(self, entity: int) -> FloatArray:
        if entity < len(self.people):
            return self.people[entity].place
        number = entity - len(self.people)
        return next(thing.pose[:2] for thing in self.things if thing.last == number)

    def _robot_heading(self, start: FloatArray) -> float:
        heading = self.scene.robot.heading
        return self._heading(GOAL if heading is None else heading, start)

    def _heading(self, heading: Amount | str, place: FloatArray) -> float:
        if isinstance(heading, str):
            return _direction(place, self.places[heading])
        return wrap_heading(heading.draw(self.rng))


def _draw_corners(room: RoomEntry, rng: np.random.Generator) -> FloatArray:
    """(num_corners, 2) [m]."""
    if room.size is None:
        return np.array([[x.draw(rng), y.draw(rng)] for x, y in room.corners])
    x, y = room.size[0].draw(rng) / 2, room.size[1].draw(rng) / 2
    return np.array([[-x, -y], [x, -y], [x, y], [-x, y]])


def _direction(origin: FloatArray, towards: FloatArray) -> float:
    return math.atan2(towards[1] - origin[1], towards[0] - origin[0])
