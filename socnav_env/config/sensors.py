"""What a user can set about how the robot sees."""

from __future__ import annotations

import math
from dataclasses import dataclass

from socnav_env.config.checks import check_flag, check_number
from socnav_env.config.scene import MAX_WALLS

ALL_AROUND = 2 * math.pi


@dataclass(frozen=True)
class SensorConfig:
    """What the robot's sensors see. By default everything, exactly, and no random number is drawn.

    Limits and noise concern people and objects in the observations `entities` and `flat`; who interacts is seen where
    both are. The robot knows the walls, its goal and itself.

    field_of_view: [rad] centred on the robot's heading
    max_range: [m] to an entity's centre; None: unlimited
    occlusion: whether walls, objects and people hide what lies behind them; tested at the entity's centre
    position_noise, heading_noise, velocity_noise: [m], [rad], [m/s] standard deviations of a normal error, new at every
        look; of coordinates, of people's and objects' headings, and of people's velocity components
    max_walls: how many walls `entities` and `flat` show, the nearest; scenarios may have rooms with more
    nearest_people, nearest_objects: how many `flat` shows
    lidar_beams: of `lidar`, spread evenly over `field_of_view`
    lidar_range: [m]
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
        """Whether there may be something in the room that is not seen."""
        return self.field_of_view < ALL_AROUND or self.max_range is not None or self.occlusion

    @property
    def is_noisy(self) -> bool:
        """Whether what is seen is not exact."""
        return self.position_noise > 0 or self.heading_noise > 0 or self.velocity_noise > 0
