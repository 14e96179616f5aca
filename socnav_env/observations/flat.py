"""The observation `flat`: one box of numbers, the nearest people, objects and walls first."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from gymnasium import spaces

from reward_model.base.arrays import Float32Array
from socnav_env.observations.entities import EntityRows

if TYPE_CHECKING:
    from socnav_env.config import EnvConfig
    from socnav_env.simulation.world import World


class FlatObservation:
    """One float32 box of consecutive parts; `slices` gives the place of each.

    robot (4,), goal (2,): as in `EntitiesObservation`
    people (nearest_people * 8,), people_mask (nearest_people,): rows as there, the nearest centre first
    objects (nearest_objects * 6,), objects_mask (nearest_objects,): likewise
    walls (max_walls * 4,), walls_mask (max_walls,): rows as there, the wall with the nearest point first

    `SensorConfig` sets the numbers of people and objects and the limits of the sensors.
    """

    def __init__(self, config: EnvConfig) -> None:
        capacities = {
            "people": config.sensors.nearest_people,
            "objects": config.sensors.nearest_objects,
            "walls": config.sensors.max_walls,
        }
        self._rows = EntityRows(config, capacities, nearest_first=True)
        self._parts = self._rows.parts
        self.size, self.slices = self._parts.size, self._parts.slices

    def space(self) -> spaces.Box:
        """Return the box."""
        return spaces.Box(self._parts.low, self._parts.high, dtype=np.float32)

    def observe(self, world: World, time_left: float) -> Float32Array:
        """Return the box's values in a new array."""
        row = np.empty(self.size, dtype=np.float32)
        self.write(world, time_left, row)
        return row

    def write(self, world: World, time_left: float, row: Float32Array) -> None:
        """Write the box's values into `row`."""
        self._rows.write(world, time_left, row)

    def unpack(self, rows: Float32Array) -> Float32Array:
        """Return the values of one row or of many, in a new array."""
        return rows.copy()
