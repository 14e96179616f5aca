"""How people walk by optimal reciprocal collision avoidance.

van den Berg et al., Reciprocal n-body collision avoidance, 2011, by their own library, RVO2, through the package pyrvo.
Everyone takes half of the care that two need; who stands, walls and objects take none. Companions are to each other
what everyone is, but that they are drawn to their places side by side.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from reward_model.base.arrays import FloatArray
from reward_model.base.numba import njit
from socnav_env.config import MAX_HASTE, ConfigError, PeopleConfig
from socnav_env.people.social_force import robot_is_near, turn_towards, way_to_formation, way_to_target
from socnav_env.people.walkers import Habits, Surroundings, Walkers

DISC_CORNERS = 8  # of the polygon around someone who stands
FAR_AWAY = 1e4  # m, where a robot that nobody notices is put


class OrcaWalk:
    """Stands in for `pedestrians.walk` in one world; keeps the simulator with all that never moves in it.

    A robot that is noticed by less than 1 is avoided as if it were narrower by that much.

    Raises:
        ConfigError: If pyrvo is not installed.
    """

    def __init__(
        self, people: PeopleConfig, robot_radius: float, around: Surroundings, num_walkers: int, step: float
    ) -> None:
        self._robot_radius, self._margin, orca = robot_radius, people.orca.margin, people.orca
        self._simulator = _simulator()
        self._simulator.set_time_step(step)
        radius = people.radius + orca.margin
        self._simulator.set_agent_defaults(
            orca.neighbour_distance, orca.max_neighbours, orca.time_horizon, orca.wall_time_horizon, radius, 0.0, [0, 0]
        )
        for _ in range(num_walkers + 1):  # the robot is the last one
            self._simulator.add_agent([0.0, 0.0])
        for corners in _obstacles(around):
            self._simulator.add_obstacle(corners)
        self._simulator.process_obstacles()
        self._preferred = np.zeros((num_walkers, 2))

    def walk(
        self,
        step: float,
        bodies: FloatArray,
        walkers: Walkers,
        stop_distance: float,
        notice: float,
        habits: Habits,
        velocities: FloatArray,
    ) -> None:
        """Find the velocities of the next physics step; see `pedestrians.walk`."""
        _prefer(bodies, walkers, stop_distance, habits, self._preferred)
        self._place(bodies, notice)
        for agent, (preferred, speed) in enumerate(zip(self._preferred.tolist(), walkers.speed.tolist(), strict=True)):
            self._simulator.set_agent_pref_velocity(agent, preferred)
            self._simulator.set_agent_max_speed(agent, MAX_HASTE * speed)
        self._simulator.do_step()
        chosen = [self._simulator.get_agent_velocity(agent).to_tuple() for agent in range(len(self._preferred))]
        _follow(step, bodies, walkers, self._preferred, np.array(chosen).reshape(-1, 2), habits, velocities)

    def _place(self, bodies: FloatArray, notice: float) -> None:
        simulator, robot = self._simulator, len(bodies) - 1
        for agent, (x, y, _, vx, vy, _) in enumerate(bodies.tolist()):
            simulator.set_agent_position(agent, [x, y])
            simulator.set_agent_velocity(agent, [vx, vy])
        simulator.set_agent_radius(robot, notice * self._robot_radius + self._margin)
        simulator.set_agent_pref_velocity(robot, bodies[robot, 3:5].tolist())
        if notice == 0.0:
            simulator.set_agent_position(robot, [FAR_AWAY, FAR_AWAY])


def _simulator() -> Any:
    try:
        import pyrvo
    except ImportError as error:
        raise ConfigError(
            'people.model "orca" needs the package pyrvo, which is not installed; pip install "socnav2[orca]"'
        ) from error
    return pyrvo.RVOSimulator()


def _obstacles(around: Surroundings) -> list[list[list[float]]]:
    """Corners of everything that stands, counter-clockwise; walls are lines."""
    angles = 2 * math.pi / DISC_CORNERS * np.arange(DISC_CORNERS)
    ring = np.column_stack([np.cos(angles), np.sin(angles)]) / math.cos(math.pi / DISC_CORNERS)
    walls = around.walls.reshape(-1, 2, 2)
    discs = around.discs[:, None, :2] + around.discs[:, None, 2:] * ring
    signs = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    along = around.boxes[:, None, 2:4] * (signs[:, 0] * around.boxes[:, 4:5])[..., None]
    across = around.boxes[:, None, [3, 2]] * [-1.0, 1.0] * (signs[:, 1] * around.boxes[:, 5:6])[..., None]
    boxes = around.boxes[:, None, :2] + along + across
    return [*walls.tolist(), *discs.tolist(), *boxes.tolist()]


@njit
def _prefer(bodies: FloatArray, walkers: Walkers, stop_distance: float, habits: Habits, preferred: FloatArray) -> None:
    """Write the velocities that walkers would have if nobody else were there, (num_walkers, 2) [m/s]."""
    for walker in range(len(preferred)):
        preferred[walker] = 0.0
        way_x, way_y, speed = way_to_target(walker, bodies, walkers)
        if speed > 0.0 and not robot_is_near(walker, bodies, walkers.group, stop_distance):
            place_x, place_y = way_to_formation(walker, bodies, walkers, way_x, way_y, habits)
            preferred[walker, 0], preferred[walker, 1] = speed * way_x + place_x, speed * way_y + place_y


@njit
def _follow(
    step: float,
    bodies: FloatArray,
    walkers: Walkers,
    preferred: FloatArray,
    chosen: FloatArray,
    habits: Habits,
    velocities: FloatArray,
) -> None:
    """Write velocities as chosen, within the acceleration allowed; walkers turn to where they would like to go."""
    for walker in range(len(chosen)):
        walkers.time_left[walker] -= step
        wanted_x, wanted_y = preferred[walker]
        turn_rate = turn_towards(walker, step, bodies, walkers, wanted_x, wanted_y, habits)[2]
        vx, vy = bodies[walker, 3], bodies[walker, 4]
        change_x, change_y = chosen[walker, 0] - vx, chosen[walker, 1] - vy
        excess = max(1.0, math.hypot(change_x, change_y) / (habits.max_acceleration * step))
        velocities[walker, 0], velocities[walker, 1] = vx + change_x / excess, vy + change_y / excess
        velocities[walker, 2] = turn_rate
