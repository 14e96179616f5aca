"""What people are and how they walk. SI units; a range is a pair (least, most), both included."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Self

from socnav_env.config.checks import ConfigError, FloatRange, check_choice, check_number, check_range

SOCIAL_FORCE, ORCA, STAND = "social_force", "orca", "standing"
WALKING_MODELS = (SOCIAL_FORCE, ORCA, STAND)
MAX_HASTE = 1.3  # times the desired speed, at most (Helbing & Molnar 1995)


@dataclass(frozen=True)
class GroupConfig:
    """What keeps people who walk together together; the last three are the forces of Moussaid et al. 2010.

    formation: [1/s] how fast they close in on places side by side; 0: they have none
    gaze: [m/s^2 per rad] slows down whoever has to turn the head to see the others; 4 in the paper, 0: not at all
    cohesion: [m/s^2] towards the middle of the group where that is far; 3 in the paper
    repulsion: [m/s^2] from a companion closer than the group's spacing; 1 in the paper
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
    """Reciprocal collision avoidance (van den Berg et al. 2011), where `people.model` is "orca".

    time_horizon: [s] for which a velocity must be free of collisions with others
    wall_time_horizon: [s] likewise with walls and objects
    neighbour_distance: [m] within which others are looked at
    max_neighbours: how many of them at most
    margin: [m] kept between bodies besides their radius
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
    """What people are and how they walk.

    model: of `WALKING_MODELS`; "standing": those who would walk stand where they are
    radius: [m] of the body that touches: shoulders 0.5 m wide
    clearance: [m] the radius people are placed with (SONATA's), though couples walk closer than that
    speed, speed_deviation, speed_limits: [m/s] a walker's desired speed: a normal distribution, cut off; with
        the time spent turning, starting and giving way it gives the speeds seen in SocNav2
    max_acceleration: [m/s^2] at most; None: only as `relaxation_time` says
    max_turn_rate: [rad/s] at most; people in SocNav2's recordings turn by up to 1.4 rad/s
    target_interval: [s] on average until a walker picks another target, drawn within a quarter of it
    stop_distance: [m] between centres, within which a walker stops for the robot (SONATA's habit)
    robot_visibility: 0..1, scales both `stop_distance` and how strongly walkers avoid the robot; 0: invisible
    relaxation_time: [s] in which a walker takes up a new velocity (Helbing & Molnar 1995)
    avoidance: [m/s^2] strength with which walkers avoid others (Moussaid et al. 2009 measured 4.5)
    avoidance_range: by how much that reaches farther for those one nears faster (theirs: 0.35)
    velocity_weight: of the relative velocity against the direction to the other (theirs: 2)
    view_angle: [rad] of the field of view, both sides together (Helbing & Molnar 1995: 200 degrees)
    unseen_weight: 0..1, of those outside it (theirs: 0.5); 1: everyone counts the same
    wall_repulsion, wall_range: [m/s^2], [m] strength and reach of walls (Moussaid et al. 2010: 3 and 0.1)
    patience: [s] a blocked walker waits before picking another target
    group, orca: see there
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
        """People in the street instead of in SocNav2's rooms: fitted to real ones, see docs/people.md."""
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
