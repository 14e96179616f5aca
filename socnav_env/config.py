"""Everything a user can set, as frozen dataclasses that refuse unknown keys and values that cannot work.

SI units throughout: metres, seconds, radians. A range is a pair (least, most), both included.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Self

from socnav_env.checks import ConfigError as ConfigError
from socnav_env.checks import check_names, check_number, check_range, check_whole

IntRange = tuple[int, int]
FloatRange = tuple[float, float]
Size = tuple[float, float]

SQUARE, RECTANGLE, L_SHAPE = "square", "rectangle", "l_shape"
ROOM_KINDS = (SQUARE, RECTANGLE, L_SHAPE)

# Relations by the names SocNav2's recordings use.
TALKING = "two_static_person_talking"
AT_LAPTOP = "human_laptop_interaction"
AT_PLANT = "human_plant_interaction"
WALKING_TOGETHER = "wandering_human_interacting"
RELATIONS = (TALKING, AT_LAPTOP, AT_PLANT, WALKING_TOGETHER)
PEOPLE_OF_RELATION = {TALKING: 2, AT_LAPTOP: 1, AT_PLANT: 1, WALKING_TOGETHER: 2}
OBJECTS_OF_RELATION = {TALKING: 0, AT_LAPTOP: 2, AT_PLANT: 1, WALKING_TOGETHER: 0}

MAX_WALLS = 6  # an L has six, the other rooms four
MAX_HASTE = 1.3  # times the desired speed, at most (Helbing & Molnar 1995)


@dataclass(frozen=True)
class RoomConfig:
    """Which rooms there are; the kinds named are equally likely. Defaults: SONATA's rooms.

    kinds: of `ROOM_KINDS`
    square_side: [m], whole numbers
    rectangle_side: [m], whole numbers; the length is drawn from the breadth up
    l_unit: [m], whole numbers: an L is a square of three units without a corner of two units by one
    """

    kinds: tuple[str, ...] = ROOM_KINDS
    square_side: IntRange = (6, 10)
    rectangle_side: IntRange = (5, 10)
    l_unit: IntRange = (3, 4)

    def __post_init__(self) -> None:
        check_names("room.kinds", self.kinds, ROOM_KINDS)
        for name in ("square_side", "rectangle_side", "l_unit"):
            check_range(f"room.{name}", getattr(self, name), least=1, whole=True)

    @property
    def smallest_sides(self) -> dict[str, tuple[float, float]]:
        """By kind, two sides of a rectangle with the area of the smallest room [m]."""
        square, breadth, unit = self.square_side[0], self.rectangle_side[0], self.l_unit[0]
        sides = {SQUARE: (square, square), RECTANGLE: (breadth, breadth), L_SHAPE: (unit, 7 * unit)}
        return {kind: sides[kind] for kind in self.kinds}


@dataclass(frozen=True)
class PopulationConfig:
    """Who and what is in the room; counts are drawn uniformly. Defaults follow SONATA.

    still, wandering: people on their own, besides those who take part in interactions
    tables, plants: without anyone at them; every table carries a laptop, which makes it two objects
    interactions: how many; each is of a kind drawn from `relations` and brings its own people and objects
    relations: of `RELATIONS`
    talking_distance: [m] between two who talk
    talking_angle: [rad] by how much each of them may look past the other
    watching_distance: [m] from a person to the laptop or plant they are occupied with
    couple_distance: [m] between two who walk side by side
    table_sizes: [m] one is drawn for each table; its laptop is recorded with the same size
    plant_size: [m]
    max_tries: how many populations are drawn for one room before giving up
    """

    still: IntRange = (0, 4)
    wandering: IntRange = (0, 4)
    tables: IntRange = (0, 3)
    plants: IntRange = (0, 3)
    interactions: IntRange = (0, 3)
    relations: tuple[str, ...] = RELATIONS
    talking_distance: FloatRange = (1.5, 3.0)
    talking_angle: float = math.radians(20)
    watching_distance: FloatRange = (1.0, 4.0)
    couple_distance: FloatRange = (0.5, 0.65)
    table_sizes: tuple[Size, ...] = ((0.79, 0.78), (0.9, 0.8))
    plant_size: Size = (0.18, 0.35)
    max_tries: int = 50

    def __post_init__(self) -> None:
        for name in ("still", "wandering", "tables", "plants", "interactions"):
            check_range(f"population.{name}", getattr(self, name), least=0, whole=True)
        for name in ("talking_distance", "watching_distance", "couple_distance"):
            check_range(f"population.{name}", getattr(self, name), least=0.1)
        check_names("population.relations", self.relations, RELATIONS)
        check_number("population.talking_angle", self.talking_angle, 0, math.pi)
        if not self.table_sizes:
            raise ConfigError("population.table_sizes must name at least one size, got none")
        for size in (*self.table_sizes, self.plant_size):
            if len(size) != 2 or not all(math.isfinite(side) and side > 0 for side in size):
                raise ConfigError(f"population: an object's size must be two positive numbers, got {size}")
        check_number("population.max_tries", self.max_tries, 1, math.inf, whole=True)

    @property
    def max_people(self) -> int:
        """The most people there can be."""
        of_relations = max(PEOPLE_OF_RELATION[relation] for relation in self.relations)
        return self.still[1] + self.wandering[1] + of_relations * self.interactions[1]

    @property
    def max_objects(self) -> int:
        """The most objects there can be; a table with its laptop counts as two."""
        of_relations = max(OBJECTS_OF_RELATION[relation] for relation in self.relations)
        return 2 * self.tables[1] + self.plants[1] + of_relations * self.interactions[1]

    @property
    def max_interactions(self) -> int:
        """The most interactions there can be."""
        return self.interactions[1]


@dataclass(frozen=True)
class PeopleConfig:
    """What people are and how they walk.

    radius: [m] of the body that touches: shoulders 0.5 m wide
    clearance: [m] the radius people are placed with (SONATA's), though couples walk closer than that
    speed, speed_deviation, speed_limits: [m/s] a walker's desired speed: a normal distribution, cut off; with
        the time spent turning, starting and giving way it gives the speeds seen in SocNav2
    max_turn_rate: [rad/s] at most; people in SocNav2's recordings turn by up to 1.4 rad/s
    target_interval: [s] on average until a walker picks another target, drawn within a quarter of it
    stop_distance: [m] between centres, within which a walker stops for the robot (SONATA's habit)
    robot_visibility: 0..1, scales both `stop_distance` and how strongly walkers avoid the robot; 0: invisible
    relaxation_time: [s] in which a walker takes up a new velocity (Helbing & Molnar 1995)
    avoidance: [m/s^2] strength with which walkers avoid others (Moussaid et al. 2009 measured 4.5)
    wall_repulsion, wall_range: [m/s^2], [m] strength and reach of walls (Moussaid et al. 2010: 3 and 0.1)
    patience: [s] a blocked walker waits before picking another target
    """

    radius: float = 0.25
    clearance: float = 0.4
    speed: float = 0.75
    speed_deviation: float = 0.1
    speed_limits: FloatRange = (0.4, 1.0)
    max_turn_rate: float = 1.5
    target_interval: float = 12.0
    stop_distance: float = 1.2
    robot_visibility: float = 1.0
    relaxation_time: float = 0.5
    avoidance: float = 4.5
    wall_repulsion: float = 3.0
    wall_range: float = 0.1
    patience: float = 2.0

    def __post_init__(self) -> None:
        for name in ("radius", "speed", "max_turn_rate", "target_interval", "relaxation_time", "wall_range"):
            check_number(f"people.{name}", getattr(self, name), 1e-3, math.inf)
        for name in ("speed_deviation", "stop_distance", "avoidance", "wall_repulsion", "patience"):
            check_number(f"people.{name}", getattr(self, name), 0, math.inf)
        check_number("people.robot_visibility", self.robot_visibility, 0, 1)
        check_range("people.speed_limits", self.speed_limits, least=1e-3)
        if self.clearance < self.radius:
            raise ConfigError(
                f"people.clearance must be at least people.radius, got {self.clearance} and {self.radius}"
            )


@dataclass(frozen=True)
class RobotConfig:
    """A round robot with a differential drive.

    radius: [m] as wide as a person, like the service robots this is about (TIAGo 0.27, Pepper 0.24)
    max_forward_speed, max_backward_speed: [m/s]; default: the fastest that SocNav2's raters saw
    max_turn_rate: [rad/s]; default likewise
    arrival_radius: [m] the robot has arrived when its centre is this close to the goal
    min_goal_distance: [m] between the robot's start and the goal
    """

    radius: float = 0.25
    max_forward_speed: float = 3.5 / 9.4
    max_backward_speed: float = 3.5 / 9.4
    max_turn_rate: float = 4 / 10.32
    arrival_radius: float = 0.5
    min_goal_distance: float = 2.0

    def __post_init__(self) -> None:
        for name in ("radius", "max_forward_speed", "max_turn_rate", "arrival_radius"):
            check_number(f"robot.{name}", getattr(self, name), 1e-3, math.inf)
        check_number("robot.max_backward_speed", self.max_backward_speed, 0, math.inf)
        check_number("robot.min_goal_distance", self.min_goal_distance, 0, math.inf)
        if self.min_goal_distance <= self.arrival_radius:
            raise ConfigError(
                "robot.min_goal_distance must be larger than robot.arrival_radius, "
                f"got {self.min_goal_distance} and {self.arrival_radius}"
            )


@dataclass(frozen=True)
class RewardConfig:
    """Weights of the named reward terms.

    social: of Q2 - 1 (or Q2) each step, arrival and contact: once, at the end; for the learned rewards
    crowdnav_*: Chen et al. 2019: arrival, contact, and discomfort within a surface distance [m]
    """

    social: float = 1.0
    arrival: float = 50.0
    contact: float = -50.0
    crowdnav_arrival: float = 1.0
    crowdnav_contact: float = -0.25
    crowdnav_discomfort: float = 0.5
    crowdnav_discomfort_distance: float = 0.2

    def __post_init__(self) -> None:
        for each in dataclasses.fields(self):
            check_number(f"reward.{each.name}", getattr(self, each.name), -math.inf, math.inf)
        check_number("reward.crowdnav_discomfort_distance", self.crowdnav_discomfort_distance, 0, math.inf)


@dataclass(frozen=True)
class EnvConfig:
    """The whole environment.

    control_period: [s] from one action to the next
    physics_step: [s] a whole number of them make a control period
    time_limit: [s] after which an episode is cut off
    warm_up: [s] simulated before the episode, the robot standing; a whole number of control periods
    """

    control_period: float = 0.2
    physics_step: float = 0.05
    time_limit: float = 60.0
    warm_up: float = 2.0
    room: RoomConfig = field(default_factory=RoomConfig)
    population: PopulationConfig = field(default_factory=PopulationConfig)
    people: PeopleConfig = field(default_factory=PeopleConfig)
    robot: RobotConfig = field(default_factory=RobotConfig)
    reward: RewardConfig = field(default_factory=RewardConfig)

    def __post_init__(self) -> None:
        for name in ("control_period", "physics_step", "time_limit"):
            check_number(name, getattr(self, name), 1e-3, math.inf)
        check_number("warm_up", self.warm_up, 0, math.inf)
        check_whole("control_period", self.control_period, "physics step", self.physics_step)
        check_whole("warm_up", self.warm_up, "control period", self.control_period)
        check_whole("time_limit", self.time_limit, "control period", self.control_period)
        self._check_speeds()
        self._check_room_for_all()

    @property
    def substeps(self) -> int:
        """How many physics steps make a control period."""
        return round(self.control_period / self.physics_step)

    @property
    def warm_up_steps(self) -> int:
        """How many control periods make the warm-up."""
        return round(self.warm_up / self.control_period)

    @property
    def max_steps(self) -> int:
        """How many control periods make the longest episode."""
        return round(self.time_limit / self.control_period)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Build from nested dicts, e.g. of a TOML or JSON file; what is left out keeps its default.

        Raises `ConfigError` for an unknown key or a value that cannot work.
        """
        config: Self = _build(cls, values, "")
        return config

    def to_dict(self) -> dict[str, Any]:
        """Nested dicts that `from_dict` turns back into an equal config."""
        return dataclasses.asdict(self)

    def _check_speeds(self) -> None:
        """Refuse speeds at which a body could pass through a wall between two physics steps."""
        robot, people = self.robot, self.people
        robot_speed = max(robot.max_forward_speed, robot.max_backward_speed)
        for name, speed, radius in (
            ("robot", robot_speed, robot.radius),
            ("people", MAX_HASTE * people.speed_limits[1], people.radius),
        ):
            if speed * self.physics_step >= radius:
                raise ConfigError(
                    f"{name}: at top speed a body must move less than its radius in a physics step, got "
                    f"{speed:g} m/s x {self.physics_step:g} s and {radius:g} m; use a smaller physics_step"
                )

    def _check_room_for_all(self) -> None:
        """Refuse what even the least populated scene of the smallest room cannot hold."""
        needed = _least_area(self.population, self.people.clearance) + 2 * _disc_area(self.people.clearance)
        for kind, sides in self.room.smallest_sides.items():
            free = sides[0] * sides[1]
            if needed > PACKING * free:
                raise ConfigError(
                    f"population: the fewest people and objects asked for need {needed:.1f} m^2, but the "
                    f"smallest {kind} room holds {PACKING * free:.1f} m^2; ask for fewer or for larger rooms"
                )


PACKING = 0.5  # share of a floor that discs placed at random, one after the other, can cover (0.547 at most)


def _disc_area(radius: float) -> float:
    return math.pi * radius**2


def _least_area(population: PopulationConfig, clearance: float) -> float:
    people_each = min(PEOPLE_OF_RELATION[relation] for relation in population.relations)
    people = population.still[0] + population.wandering[0] + people_each * population.interactions[0]
    table = min(width * depth for width, depth in population.table_sizes)
    plant = population.plant_size[0] * population.plant_size[1]
    return people * _disc_area(clearance) + population.tables[0] * table + population.plants[0] * plant


def _build(kind: type[Any], values: Mapping[str, Any], place: str) -> Any:
    if not isinstance(values, Mapping):
        raise ConfigError(f"{place.rstrip('.') or 'the config'} must be a table of keys and values, got {values!r}")
    fields = {each.name: each for each in dataclasses.fields(kind)}
    arguments: dict[str, Any] = {}
    for key, value in values.items():
        if key not in fields:
            raise ConfigError(f"unknown key {place}{key}, the valid ones are {', '.join(sorted(fields))}")
        default = fields[key].default_factory
        if default is not dataclasses.MISSING:
            arguments[key] = _build(default, value, f"{place}{key}.")  # type: ignore[arg-type]
        else:
            arguments[key] = _as_tuples(value)
    return kind(**arguments)


def _as_tuples(value: Any) -> Any:
    return tuple(_as_tuples(each) for each in value) if isinstance(value, (list, tuple)) else value
