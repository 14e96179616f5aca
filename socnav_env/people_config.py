"""What people are and how they walk. SI units; a range is a pair (least, most), both included."""

from __future__ import annotations

import math
from dataclasses import dataclass

from socnav_env.checks import ConfigError, FloatRange, check_number, check_range

MAX_HASTE = 1.3  # times the desired speed, at most (Helbing & Molnar 1995)


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
