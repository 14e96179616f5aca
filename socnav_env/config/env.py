"""Configuration of the environment: its parts, and the rules across them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Self

from socnav_env.config.checks import ConfigError, check_number, check_whole
from socnav_env.config.people import MAX_HASTE, PeopleConfig
from socnav_env.config.rewards import RewardConfig
from socnav_env.config.robot import MOST_NOISE, RobotConfig
from socnav_env.config.scene import PACKING, PopulationConfig, RoomConfig, disc_area, least_area
from socnav_env.config.sensors import SensorConfig


@dataclass(frozen=True)
class EnvConfig:
    """Configuration of the environment.

    Attributes:
        control_period: [s] from one action to the next
        physics_step: [s] duration of a physics step; a control period is a whole number of them
        time_limit: [s] after which an episode is truncated
        warm_up: [s] simulated before the episode while the robot stands; a whole number of control periods
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
    sensors: SensorConfig = field(default_factory=SensorConfig)

    def __post_init__(self) -> None:
        for name in ("control_period", "physics_step", "time_limit"):
            check_number(name, getattr(self, name), 1e-3, math.inf)
        check_number("warm_up", self.warm_up, 0, math.inf)
        check_whole("control_period", self.control_period, "physics step", self.physics_step)
        check_whole("warm_up", self.warm_up, "control period", self.control_period)
        check_whole("time_limit", self.time_limit, "control period", self.control_period)
        self._check_speeds()
        self._check_circles()
        self._check_room_for_all()

    @property
    def substeps(self) -> int:
        """The number of physics steps in a control period."""
        return round(self.control_period / self.physics_step)

    @property
    def warm_up_steps(self) -> int:
        """The number of control periods in the warm-up."""
        return round(self.warm_up / self.control_period)

    @property
    def max_steps(self) -> int:
        """The maximum number of control periods in an episode."""
        return round(self.time_limit / self.control_period)

    @property
    def in_rated_range(self) -> bool:
        """Whether the raters of SocNav2 saw such a robot as is judged: slowed by `reward.time_scale`."""
        return self.robot.drive_type.rated and self.robot.rated_time_scale <= self.reward.time_scale + 1e-9

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Build from nested dicts, e.g. of a TOML or JSON file; missing keys keep their defaults.

        Raises:
            ConfigError: For an unknown key or an invalid value.
        """
        config: Self = _build(cls, values, "")
        return config

    def to_dict(self) -> dict[str, Any]:
        """The configuration as nested dicts; `from_dict` turns them into an equal configuration."""
        return dataclasses.asdict(self)

    def _check_speeds(self) -> None:
        """Refuse speeds at which a body could pass through a wall between two physics steps."""
        robot, people = self.robot, self.people
        robot_speed = robot.top_speed + math.sqrt(2) * MOST_NOISE * robot.speed_noise
        for name, speed, radius in (
            ("robot", robot_speed, robot.radius),
            ("people", MAX_HASTE * people.speed_limits[1], people.radius),
        ):
            if speed * self.physics_step >= radius:
                raise ConfigError(
                    f"{name}: at top speed a body must move less than its radius in a physics step, got "
                    f"{speed:g} m/s x {self.physics_step:g} s and {radius:g} m; use a smaller physics_step"
                )

    def _check_circles(self) -> None:
        """Refuse circles in which people would touch."""
        spacing, radius = self.population.circle_spacing[0], self.people.radius
        if spacing < 2 * radius:
            raise ConfigError(
                f"population.circle_spacing must be at least twice people.radius, got {spacing} and {radius}"
            )

    def _check_room_for_all(self) -> None:
        """Refuse populations whose minimum does not fit into the smallest room."""
        needed = least_area(self.population, self.people.clearance) + 2 * disc_area(self.people.clearance)
        for kind, sides in self.room.smallest_sides.items():
            free = sides[0] * sides[1]
            if needed > PACKING * free:
                raise ConfigError(
                    f"population: the fewest people and objects asked for need {needed:.1f} m^2, but the "
                    f"smallest {kind} room holds {PACKING * free:.1f} m^2; ask for fewer or for larger rooms"
                )


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
