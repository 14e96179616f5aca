"""The observation `lidar`: distances measured by a laser scanner."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from gymnasium import spaces

from reward_model.base.arrays import Float32Array
from socnav_env.geometry.rays import ray_distances
from socnav_env.observations.base import ROBOT, Parts, place_bounds
from socnav_env.observations.kernels import write_points, write_robot

if TYPE_CHECKING:
    from socnav_env.config import EnvConfig
    from socnav_env.simulation.world import World


class LidarObservation:
    """A flat `Dict` of float32 boxes: the robot's own state, its goal, and a laser scanner in its centre.

    robot (4,), goal (2,): as in `EntitiesObservation`
    lidar (lidar_beams,): [m] to the first person, object or wall, at most `lidar_range`. The beams are spread evenly
        over `field_of_view`, from the robot's right to its left; of n beams the first is 1 / (2 n) of the field inside
        its edge. `beams` has their angles from the heading [rad].

    See `SensorConfig` for these numbers.
    """

    def __init__(self, config: EnvConfig) -> None:
        sensors = config.sensors
        count, self._range = sensors.lidar_beams, sensors.lidar_range
        self.beams = ((np.arange(count) + 0.5) / count - 0.5) * sensors.field_of_view
        lidar = [(0.0, self._range)] * count
        self._parts = Parts({"robot": ROBOT, "goal": place_bounds(config), "lidar": lidar})
        self.size = self._parts.size

    def space(self) -> spaces.Dict:
        """Return the boxes."""
        return self._parts.space()

    def observe(self, world: World, time_left: float) -> dict[str, Float32Array]:
        """Return the boxes' values in new arrays."""
        row = np.empty(self.size, dtype=np.float32)
        self.write(world, time_left, row)
        return self._parts.split(row)

    def write(self, world: World, time_left: float, row: Float32Array) -> None:
        """Write the boxes' values one after the other."""
        pose, parts = world.state.robot_pose, self._parts.split(row)
        write_robot(parts["robot"], pose, world.state.robot_velocity, time_left)
        write_points(parts["goal"], pose, world.layout.goal)
        parts["lidar"][:] = ray_distances(pose[0], pose[1], pose[2] + self.beams, self._range, *world.obstacles())
        self._parts.clip(row)

    def unpack(self, rows: Float32Array) -> dict[str, Float32Array]:
        """Return the boxes' values, of one row or of many, in new arrays."""
        return {name: values.copy() for name, values in self._parts.split(rows).items()}
