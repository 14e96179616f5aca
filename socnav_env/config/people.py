"""Configuration of people and their walking. SI units; a range is a pair (least, most), both included."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Self

from socnav_env.config.checks import ConfigError, FloatRange, check_choice, check_number, check_range

SOCIAL_FORCE, ORCA, STAND = "social_force", "orca", "standing"
WALKING_MODELS = (SOCIAL_FORCE, ORCA, STAND)
MAX_HASTE = 1.3  # maximum speed as a multiple of the desired speed (Helbing & Molnar 1995)


@dataclass(frozen=True)
class GroupConfig:
    """Parameters that keep walking groups together; the last three are the forces of Moussaid et al. 2010.

    Attributes:
        formation: [1/s] rate at which members approach their places side by side; 0: no such places
        gaze: [m/s^2 per rad] slows down a person who must turn the head to see the others; 4 in the paper, 0: none
        cohesion: [m/s^2] towards the centre of the group if that is far away; 3 in the paper
        repulsion: [m/s^2] away from a companion closer than the group's spacing; 1 in the paper
    """

    formation: float = 1.0
    gaze: float = 0.0
    cohesion: float = 0.0
    repulsion: float = 0.0

    def __post_init__(self) -> None:
        for name in ("formation", "gaze", "cohesion", "repulsion"):
            check_number(f"people.group.{name}", getattr(self, name), 0, math.inf)


@dataclass(frozen=True)
class OrcaConfig:
    """Reciprocal collision avoidance (van den Berg et al. 2011), used if `people.model` is "orca".

    Attributes:
        time_horizon: [s] for which a velocity must be free of collisions with others
        wall_time_horizon: [s] the same for walls and objects
        neighbour_distance: [m] within which others are taken into account
        max_neighbours: maximum number of others taken into account
        margin: [m] kept between bodies, besides their radii
    """

    time_horizon: float = 3.0
    wall_time_horizon: float = 1.0
    neighbour_distance: float = 5.0
    max_neighbours: int = 10
    margin: float = 0.05

    def __post_init__(self) -> None:
        for name in ("time_horizon", "wall_time_horizon", "neighbour_distance"):
            check_number(f"people.orca.{name}", getattr(self, name), 1e-3, math.inf)
        check_number("people.orca.max_neighbours", self.max_neighbours, 1, math.inf, whole=True)
        check_number("people.orca.margin", self.margin, 0, math.inf)


@dataclass(frozen=True)
class PeopleConfig:
    """Properties of people and of their walking.

    Attributes:
        model: walking model, from `WALKING_MODELS`; "standing": people who would walk stand still
        radius: [m] of the body in contacts: shoulders 0.5 m wide
        clearance: [m] radius used to place people (as in SONATA); couples walk closer than that
        speed, speed_deviation, speed_limits: [m/s] mean, standard deviation and limits of a walker's desired speed, a
            clipped normal distribution; with turning, starting and giving way it gives the speeds in SocNav2
        max_acceleration: [m/s^2]; None: limited by `relaxation_time` alone
        max_turn_rate: [rad/s]; people in SocNav2's recordings turn at up to 1.4 rad/s
        target_interval: [s] mean time until a walker picks another target, drawn within a quarter of it
        stop_distance: [m] between centres, below which a walker stops for the robot (as in SONATA)
        robot_visibility: 0..1, factor of `stop_distance` and of walkers' avoidance of the robot; 0: invisible
        relaxation_time: [s] in which a walker adopts a new velocity (Helbing & Molnar 1995)
        avoidance: [m/s^2] strength of the social force between people (Moussaid et al. 2009 measured 4.5)
        avoidance_range: growth of the social force's range with the speed of approach (theirs: 0.35)
        velocity_weight: weight of the relative velocity against the direction to the other (theirs: 2)
        view_angle: [rad] full width of the field of view (Helbing & Molnar 1995: 200 degrees)
        unseen_weight: 0..1, weight of people outside the field of view (theirs: 0.5); 1: everyone counts the same
        wall_repulsion, wall_range: [m/s^2], [m] strength and range of walls' repulsion (Moussaid et al. 2010: 3 and
            0.1)
        patience: [s] for which a blocked walker waits before picking another target
        group, orca: see `GroupConfig` and `OrcaConfig`
    """

    model: str = SOCIAL_FORCE
    radius: float = 0.25
    clearance: float = 0.4
    speed: float = 0.75
    speed_deviation: float = 0.1
    speed_limits: FloatRange = (0.4, 1.0)
    max_acceleration: float | None = None
    max_turn_rate: float = 1.5
    target_interval: float = 12.0
    stop_distance: float = 1.2
    robot_visibility: float = 1.0
    relaxation_time: float = 0.5
    avoidance: float = 4.5
    avoidance_range: float = 0.35
    velocity_weight: float = 2.0
    view_angle: float = math.radians(200)
    unseen_weight: float = 1.0
    wall_repulsion: float = 3.0
    wall_range: float = 0.1
    patience: float = 2.0
    group: GroupConfig = field(default_factory=GroupConfig)
    orca: OrcaConfig = field(default_factory=OrcaConfig)

    @classmethod
    def pedestrians(cls) -> Self:
        """Pedestrians in the street, not in SocNav2's rooms: fitted to real trajectories, see docs/people.md."""
        return cls(
            speed=1.4,
            speed_deviation=0.4,
            speed_limits=(0.5, 2.0),
            relaxation_time=0.4,
            max_turn_rate=1.6,
            avoidance=5.4,
            avoidance_range=0.11,
            velocity_weight=3.7,
            unseen_weight=0.96,
        )

    def __post_init__(self) -> None:
        check_choice("people.model", self.model, WALKING_MODELS)
        for name in ("radius", "speed", "max_turn_rate", "target_interval", "relaxation_time", "wall_range"):
            check_number(f"people.{name}", getattr(self, name), 1e-3, math.inf)
        for name in ("speed_deviation", "stop_distance", "avoidance", "velocity_weight", "wall_repulsion", "patience"):
            check_number(f"people.{name}", getattr(self, name), 0, math.inf)
        check_number("people.avoidance_range", self.avoidance_range, 1e-3, math.inf)
        check_number("people.robot_visibility", self.robot_visibility, 0, 1)
        check_number("people.unseen_weight", self.unseen_weight, 0, 1)
        check_number("people.view_angle", self.view_angle, 0, 2 * math.pi)
        check_range("people.speed_limits", self.speed_limits, least=1e-3)
        if self.max_acceleration is not None:
            check_number("people.max_acceleration", self.max_acceleration, 1e-3, math.inf)
        if self.clearance < self.radius:
            raise ConfigError(
                f"people.clearance must be at least people.radius, got {self.clearance} and {self.radius}"
            )
