"""Configuration of the robot, and its drives."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Final

from socnav_env.config.checks import ConfigError, check_choice, check_number

MOST_NOISE = 3.0  # standard deviations, at which noise is cut off

RATED_SPEED = 3.5 / 9.4  # m/s, the fastest robot that the raters of SocNav2 saw
RATED_TURN_RATE = 4.0 / 10.32  # rad/s, likewise

FORWARD, LEFT, TURN = "forward", "left", "turn"
COMPONENTS = (FORWARD, LEFT, TURN)  # of a command, whatever the drive


@dataclass(frozen=True)
class DriveType:
    """The facts about a drive; `socnav_env.simulation.actions` has what its actions mean.

    Attributes:
        axes: names of an action's numbers, in their order
        moves: those of `COMPONENTS` that the robot's velocity can have
        rated: whether the raters of SocNav2 saw such a robot
    """

    axes: tuple[str, ...]
    moves: tuple[str, ...]
    rated: bool = False


DRIVES: Final[Mapping[str, DriveType]] = MappingProxyType(
    {
        "differential": DriveType(axes=(FORWARD, TURN), moves=(FORWARD, TURN), rated=True),
        "holonomic": DriveType(axes=COMPONENTS, moves=COMPONENTS),
    }
)


@dataclass(frozen=True)
class RobotConfig:
    """A round robot.

    Attributes:
        drive: "differential" (forward and turn) or "holonomic" (forward, to the left and turn)
        radius: [m] as wide as a person, like service robots (TIAGo 0.27, Pepper 0.24)
        max_forward_speed, max_backward_speed: [m/s] default: the fastest that SocNav2's raters saw
        max_sideways_speed: [m/s] of a holonomic robot, to either side
        max_turn_rate: [rad/s] default: the fastest that SocNav2's raters saw
        max_acceleration: [m/s^2] maximum change of the velocity, a vector in the robot's frame; None: no limit
        max_turn_acceleration: [rad/s^2] maximum change of the turn rate; None: no limit
        speed_noise, turn_noise: [m/s], [rad/s] standard deviation of the velocity's error at full speed or full turn
            rate, drawn once each control period; smaller in proportion for a gentler command, so that a robot commanded
            to stand does. Normal, cut off at three deviations.
        arrival_radius: [m] distance of the robot's centre to the goal at which it has arrived
        min_goal_distance: [m] between the robot's start and the goal
    """

    drive: str = "differential"
    radius: float = 0.25
    max_forward_speed: float = RATED_SPEED
    max_backward_speed: float = RATED_SPEED
    max_sideways_speed: float = RATED_SPEED
    max_turn_rate: float = RATED_TURN_RATE
    max_acceleration: float | None = None
    max_turn_acceleration: float | None = None
    speed_noise: float = 0.0
    turn_noise: float = 0.0
    arrival_radius: float = 0.5
    min_goal_distance: float = 2.0

    def __post_init__(self) -> None:
        check_choice("robot.drive", self.drive, tuple(DRIVES))
        for name in ("radius", "max_forward_speed", "max_turn_rate", "arrival_radius"):
            check_number(f"robot.{name}", getattr(self, name), 1e-3, math.inf)
        for name in ("max_backward_speed", "max_sideways_speed", "speed_noise", "turn_noise", "min_goal_distance"):
            check_number(f"robot.{name}", getattr(self, name), 0, math.inf)
        for name in ("max_acceleration", "max_turn_acceleration"):
            if getattr(self, name) is not None:
                check_number(f"robot.{name}", getattr(self, name), 1e-3, math.inf)
        if self.min_goal_distance <= self.arrival_radius:
            raise ConfigError(
                "robot.min_goal_distance must be larger than robot.arrival_radius, "
                f"got {self.min_goal_distance} and {self.arrival_radius}"
            )

    @cached_property
    def drive_type(self) -> DriveType:
        """The entry of `DRIVES`."""
        return DRIVES[self.drive]

    @property
    def top_speed(self) -> float:
        """[m/s] that it can be told to drive at, in whichever direction is fastest."""
        sideways = self.max_sideways_speed if LEFT in self.drive_type.moves else 0.0
        return max(self.max_forward_speed, self.max_backward_speed, sideways)

    @property
    def in_rated_range(self) -> bool:
        """Whether the raters of SocNav2 saw such a robot: none that drives sideways, and none that is faster."""
        return self.drive_type.rated and self.rated_time_scale <= 1 + 1e-9

    @property
    def rated_time_scale(self) -> float:
        """The smallest `reward.time_scale`, at least 1, that makes its top speeds those that SocNav2's raters saw."""
        return max(1.0, self.top_speed / RATED_SPEED, self.max_turn_rate / RATED_TURN_RATE)
