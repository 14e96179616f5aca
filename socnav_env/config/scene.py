"""Configuration of rooms, people and objects. SI units; a range is a pair (least, most), both included."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from socnav_env.config.checks import (
    ConfigError,
    FloatRange,
    IntRange,
    check_flag,
    check_names,
    check_number,
    check_range,
    check_weights,
)

Size = tuple[float, float]

SQUARE, RECTANGLE, L_SHAPE = "square", "rectangle", "l_shape"
ROOM_KINDS = (SQUARE, RECTANGLE, L_SHAPE)

# Relations, named as in SocNav2's recordings.
TALKING = "two_static_person_talking"
AT_LAPTOP = "human_laptop_interaction"
AT_PLANT = "human_plant_interaction"
WALKING_TOGETHER = "wandering_human_interacting"
RELATIONS = (TALKING, AT_LAPTOP, AT_PLANT, WALKING_TOGETHER)
PEOPLE_OF_RELATION = {TALKING: 2, AT_LAPTOP: 1, AT_PLANT: 1, WALKING_TOGETHER: 2}
OBJECTS_OF_RELATION = {TALKING: 0, AT_LAPTOP: 2, AT_PLANT: 1, WALKING_TOGETHER: 0}

MAX_WALLS = 6  # an L-shaped room has six, the other rooms have four


@dataclass(frozen=True)
class RoomConfig:
    """Kinds and sizes of rooms. Defaults: SONATA's rooms.

    Attributes:
        kinds: kinds of rooms, from `ROOM_KINDS`
        kind_weights: relative probability of each of `kinds`; empty: all the same
        square_side: [m], whole numbers
        rectangle_side: [m], whole numbers; the length is drawn from the breadth upwards
        l_unit: [m], whole numbers: an L is a square of three by three units without a corner of two units by one
        turned: whether rooms have a random rotation in the world; otherwise their walls are parallel to its axes
    """

    kinds: tuple[str, ...] = ROOM_KINDS
    kind_weights: tuple[float, ...] = ()
    square_side: IntRange = (6, 10)
    rectangle_side: IntRange = (5, 10)
    l_unit: IntRange = (3, 4)
    turned: bool = False

    def __post_init__(self) -> None:
        check_names("room.kinds", self.kinds, ROOM_KINDS)
        check_weights("room.kind_weights", self.kind_weights, "room.kinds", len(self.kinds))
        check_flag("room.turned", self.turned)
        for name in ("square_side", "rectangle_side", "l_unit"):
            check_range(f"room.{name}", getattr(self, name), least=1, whole=True)

    @property
    def smallest_sides(self) -> dict[str, tuple[float, float]]:
        """Two sides [m] of a rectangle with the area of the smallest room, by kind of room."""
        square, breadth, unit = self.square_side[0], self.rectangle_side[0], self.l_unit[0]
        sides = {SQUARE: (square, square), RECTANGLE: (breadth, breadth), L_SHAPE: (unit, 7 * unit)}
        return {kind: sides[kind] for kind in self.kinds}


@dataclass(frozen=True)
class ConversationConfig:
    """Rates at which people join and leave standing conversations during an episode. Off by default.

    Attributes:
        join_rate: [1/s] rate at which each wandering person decides to join a conversation
        leave_rate: [1/s] rate at which each talking person decides to leave; the last one left leaves too
        max_size: maximum number of people in a conversation
    """

    join_rate: float = 0.0
    leave_rate: float = 0.0
    max_size: int = 5

    def __post_init__(self) -> None:
        for name in ("join_rate", "leave_rate"):
            check_number(f"population.conversations.{name}", getattr(self, name), 0, math.inf)
        check_number("population.conversations.max_size", self.max_size, 2, math.inf, whole=True)

    @property
    def change(self) -> bool:
        """Whether people can join or leave conversations."""
        return self.join_rate > 0 or self.leave_rate > 0


@dataclass(frozen=True)
class PopulationConfig:
    """People, objects and interactions in the room; counts are drawn uniformly. Defaults follow SONATA.

    Attributes:
        still, wandering: number of people on their own, besides those in interactions
        tables, plants: number of each, besides interactions; every table carries a laptop and counts as two objects
        interactions: number of interactions; each has a kind drawn from `relations` and its own people and objects
        relations: kinds of interactions, from `RELATIONS`
        relation_weights: relative probability of each of `relations`; empty: all the same
        talking_distance: [m] between two people who talk
        talking_angle: [rad] maximum angle between the heading of each and the direction to the other
        watching_distance: [m] from a person to the laptop or plant they interact with
        couple_distance: [m] between neighbours who walk side by side
        walking_groups, walking_group_size: number of groups walking abreast, besides couples, and of people in each
        circles, circle_size: number of groups standing in a circle and talking, and of people in each
        circle_spacing: [m] between neighbours in a circle, the same for all; everyone faces the centre
        table_sizes: [m] widths and depths, one drawn for each table; its laptop is recorded with the same size
        plant_size: [m] width and depth
        max_tries: maximum number of populations drawn for one room
        redraw_counts: whether counts are drawn anew too if a population does not fit, which makes crowds a little rarer
            than their range says; otherwise only places are drawn anew
        conversations: see `ConversationConfig`
    """

    still: IntRange = (0, 4)
    wandering: IntRange = (0, 4)
    tables: IntRange = (0, 3)
    plants: IntRange = (0, 3)
    interactions: IntRange = (0, 3)
    relations: tuple[str, ...] = RELATIONS
    relation_weights: tuple[float, ...] = ()
    talking_distance: FloatRange = (1.5, 3.0)
    talking_angle: float = math.radians(20)
    watching_distance: FloatRange = (1.0, 4.0)
    couple_distance: FloatRange = (0.5, 0.65)
    walking_groups: IntRange = (0, 0)
    walking_group_size: IntRange = (3, 5)
    circles: IntRange = (0, 0)
    circle_size: IntRange = (3, 5)
    circle_spacing: FloatRange = (0.9, 1.3)
    table_sizes: tuple[Size, ...] = ((0.79, 0.78), (0.9, 0.8))
    plant_size: Size = (0.18, 0.35)
    max_tries: int = 50
    redraw_counts: bool = True
    conversations: ConversationConfig = field(default_factory=ConversationConfig)

    def __post_init__(self) -> None:
        for name in ("still", "wandering", "tables", "plants", "interactions", "walking_groups", "circles"):
            check_range(f"population.{name}", getattr(self, name), least=0, whole=True)
        for name in ("walking_group_size", "circle_size"):
            check_range(f"population.{name}", getattr(self, name), least=2, whole=True)
        for name in ("talking_distance", "watching_distance", "couple_distance", "circle_spacing"):
            check_range(f"population.{name}", getattr(self, name), least=0.1)
        check_names("population.relations", self.relations, RELATIONS)
        check_weights("population.relation_weights", self.relation_weights, "population.relations", len(self.relations))
        check_flag("population.redraw_counts", self.redraw_counts)
        check_number("population.talking_angle", self.talking_angle, 0, math.pi)
        if not self.table_sizes:
            raise ConfigError("population.table_sizes must name at least one size, got none")
        for size in (*self.table_sizes, self.plant_size):
            if len(size) != 2 or not all(math.isfinite(side) and side > 0 for side in size):
                raise ConfigError(f"population: an object's size must be two positive numbers, got {size}")
        check_number("population.max_tries", self.max_tries, 1, math.inf, whole=True)

    @property
    def max_people(self) -> int:
        """The maximum number of people."""
        of_relations = max(PEOPLE_OF_RELATION[relation] for relation in self.relations)
        in_groups = self.walking_groups[1] * self.walking_group_size[1] + self.circles[1] * self.circle_size[1]
        return self.still[1] + self.wandering[1] + of_relations * self.interactions[1] + in_groups

    @property
    def max_objects(self) -> int:
        """The maximum number of objects; a table with its laptop counts as two."""
        of_relations = max(OBJECTS_OF_RELATION[relation] for relation in self.relations)
        return 2 * self.tables[1] + self.plants[1] + of_relations * self.interactions[1]

    @property
    def max_interactions(self) -> int:
        """The maximum number of interacting pairs: neighbours in a walking group, all pairs of a circle."""
        walking = self.walking_groups[1] * (self.walking_group_size[1] - 1)
        in_circle, of_two = self.circle_size[1], 1
        if self.conversations.change:
            in_circle = max(in_circle, self.conversations.max_size)
            of_two = math.comb(self.conversations.max_size, 2) if TALKING in self.relations else 1
        return self.interactions[1] * of_two + walking + self.circles[1] * math.comb(in_circle, 2)


PACKING = 0.5  # share of a floor that discs placed at random, one after the other, can cover (0.547 at most)


def disc_area(radius: float) -> float:
    """Area of a disc [m^2]."""
    return math.pi * radius**2


def least_area(population: PopulationConfig, clearance: float) -> float:
    """Area covered by the minimum numbers of people, as discs of radius `clearance` [m], and of objects [m^2]."""
    people_each = min(PEOPLE_OF_RELATION[relation] for relation in population.relations)
    people = population.still[0] + population.wandering[0] + people_each * population.interactions[0]
    people += population.walking_groups[0] * population.walking_group_size[0]
    people += population.circles[0] * population.circle_size[0]
    table = min(width * depth for width, depth in population.table_sizes)
    plant = population.plant_size[0] * population.plant_size[1]
    return people * disc_area(clearance) + population.tables[0] * table + population.plants[0] * plant
