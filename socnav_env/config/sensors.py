"""Configuration of the robot's sensors."""

from __future__ import annotations

import math
from dataclasses import dataclass

from socnav_env.config.checks import check_flag, check_number
from socnav_env.config.scene import MAX_WALLS

ALL_AROUND = 2 * math.pi


@dataclass(frozen=True)
class SensorConfig:
    """Limits and noise of the robot's sensors. By default everything is observed exactly, without random numbers.

    Limits and noise apply to people and objects in the observations `entities` and `flat`. An interaction is observed
    if both its entities are. The walls, the goal and the robot's own state are always known.

    Attributes:
        field_of_view: [rad] centred on the robot's heading
        max_range: [m] to an entity's centre; None: unlimited
        occlusion: whether walls, objects and people hide what lies behind them; tested at the entity's centre
        position_noise, heading_noise, velocity_noise: [m], [rad], [m/s] standard deviations of normal errors, new at
            every step: of coordinates, of people's and objects' headings, and of people's velocity components
        max_walls: number of walls in `entities` and `flat`, the nearest ones; rooms of scenarios may have more
        nearest_people, nearest_objects: number of each in `flat`
        lidar_beams: number of beams of `lidar`, spread evenly over `field_of_view`
        lidar_range: [m] maximum distance that `lidar` measures
    """

    field_of_view: float = ALL_AROUND
    max_range: float | None = None
    occlusion: bool = False
    position_noise: float = 0.0
    heading_noise: float = 0.0
    velocity_noise: float = 0.0
    max_walls: int = MAX_WALLS
    nearest_people: int = 5
    nearest_objects: int = 5
    lidar_beams: int = 64
    lidar_range: float = 10.0

    def __post_init__(self) -> None:
        check_number("sensors.field_of_view", self.field_of_view, 1e-3, ALL_AROUND)
        if self.max_range is not None:
            check_number("sensors.max_range", self.max_range, 1e-3, math.inf)
        check_flag("sensors.occlusion", self.occlusion)
        for name in ("position_noise", "heading_noise", "velocity_noise"):
            check_number(f"sensors.{name}", getattr(self, name), 0, math.inf)
        for name in ("max_walls", "nearest_people", "nearest_objects"):
            check_number(f"sensors.{name}", getattr(self, name), 0, math.inf, whole=True)
        check_number("sensors.lidar_beams", self.lidar_beams, 1, math.inf, whole=True)
        check_number("sensors.lidar_range", self.lidar_range, 1e-3, math.inf)

    @property
    def is_limited(self) -> bool:
        """Whether people or objects in the room can be missing from an observation."""
        return self.field_of_view < ALL_AROUND or self.max_range is not None or self.occlusion

    @property
    def is_noisy(self) -> bool:
        """Whether observations have noise."""
        return self.position_noise > 0 or self.heading_noise > 0 or self.velocity_noise > 0
