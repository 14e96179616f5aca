"""The observation `entities`: everything in the room, as boxes with masks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from gymnasium import spaces

from reward_model.base.arrays import Float32Array
from socnav_env.observations.base import (
    MOTION,
    ROBOT,
    SHARE,
    Bounds,
    Parts,
    longest_sight,
    place_bounds,
)
from socnav_env.observations.kernels import write_entities
from socnav_env.observations.sensors import look

if TYPE_CHECKING:
    from socnav_env.config import EnvConfig
    from socnav_env.simulation.world import World

ENTITY_WIDTHS = {"people": 8, "objects": 6, "walls": 4, "interactions": 4}  # numbers in an entity's row


def entity_rows(config: EnvConfig) -> dict[str, Bounds]:
    """The bounds of the numbers in an entity's row, by kind."""
    place, unit, sight = place_bounds(config), [(-1.0, 1.0)] * 2, longest_sight(config.room)
    return {
        "people": place + unit + MOTION + SHARE,
        "objects": place + unit + [(0.0, sight)] * 2,
        "walls": place + place,
        "interactions": place + place,
    }


def entity_parts(config: EnvConfig, capacities: dict[str, int]) -> Parts:
    """The robot, the goal, and rows and a mask for each kind of entity that has a capacity."""
    bounds = {"robot": ROBOT, "goal": place_bounds(config)}
    for name, row in entity_rows(config).items():
        if name in capacities:
            bounds[name], bounds[f"{name}_mask"] = row * capacities[name], SHARE * capacities[name]
    return Parts(bounds)


class EntityRows:
    """Rows of numbers about the robot, its goal and those in the room, which `entities` and `flat` are made of.

    Args:
        capacities: rows of each kind of entity: people, objects, walls and, where they are shown, interactions
        nearest_first: whether entities are sorted by their distance
    """

    def __init__(self, config: EnvConfig, capacities: dict[str, int], nearest_first: bool) -> None:
        self.parts = entity_parts(config, capacities)
        self._sensors = config.sensors
        self._plan = self.parts.starts, np.array(list(capacities.values())), nearest_first

    def write(self, world: World, time_left: float, row: Float32Array) -> None:
        """Write what the robot sees now into `row`, (size,), all of it."""
        layout, state = world.layout, world.state
        sight = look(world, self._sensors)
        write_entities(
            row,
            *self._plan,
            state.robot_pose,
            state.robot_velocity,
            time_left,
            layout.goal,
            layout.room.corners,
            sight.people_poses,
            sight.people_velocities,
            sight.object_poses,
            sight.object_sizes,
            sight.interaction_pairs,
        )
        self.parts.clip(row)


class EntitiesObservation:
    """The robot, its goal and everything in the room, as a flat `Dict` of float32 boxes with presence masks.

    robot (4,): forward speed [m/s], speed to the left [m/s], turn rate [rad/s], share of the time that is left
    goal (2,): x, y [m]
    people (max_people * 8,): rows of x, y, cos heading, sin heading, vx, vy (over ground, along the robot's axes),
            turn rate, 1 for a person who interacts
    objects (max_objects * 6,): rows of x, y, cos heading, sin heading, width, depth
    walls (max_walls * 4,): rows of x1, y1, x2, y2
    interactions (max_interactions * 4,): rows of x1, y1, x2, y2 of the two who interact
    people_mask, objects_mask, walls_mask, interactions_mask: 1 where there is a row, 0 where the row is all zeros

    Rows reshape to (-1, ENTITY_WIDTHS[name]). Their number is the maximum that the config allows; of more than that (in
    a layout from elsewhere) the nearest are observed, of lines those with the nearest points. `SensorConfig` sets the
    number of walls and can limit what is observed.
    """

    def __init__(self, config: EnvConfig) -> None:
        population = config.population
        self.capacities = {
            "people": population.max_people,
            "objects": population.max_objects,
            "walls": config.sensors.max_walls,
            "interactions": population.max_interactions,
        }
        self._rows = EntityRows(config, self.capacities, nearest_first=False)
        self._parts = self._rows.parts
        self.size = self._parts.size

    def space(self) -> spaces.Dict:
        """Return the boxes; a kind of entity that the config rules out has none."""
        return self._parts.space()

    def observe(self, world: World, time_left: float) -> dict[str, Float32Array]:
        """Return the boxes' values in new arrays."""
        row = np.empty(self.size, dtype=np.float32)
        self.write(world, time_left, row)
        return self._parts.split(row)

    def write(self, world: World, time_left: float, row: Float32Array) -> None:
        """Write the boxes' values one after the other."""
        self._rows.write(world, time_left, row)

    def unpack(self, rows: Float32Array) -> dict[str, Float32Array]:
        """Return the boxes' values, of one row or of many, in new arrays."""
        return {name: values.copy() for name, values in self._parts.split(rows).items()}
