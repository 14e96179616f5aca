"""The script of a scenario's episode: a warm-up that ends where the scenario begins, and people's routes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from reward_model.base.arrays import FloatArray
from socnav_env.config import EnvConfig
from socnav_env.layout import Ending, Script
from socnav_env.scenarios.floor import Floor

STANDING_BACK: Final = 0.01  # m of free way behind a person that counts as none


@dataclass(frozen=True)
class Walk:
    """A person's walk from the start of the episode on.

    Attributes:
        speed: [m/s] desired speed; NaN: drawn
        under_way: whether they are walking when the episode begins
        route: (num_places, 2) [m], empty without a route
        delay: [s] waiting time before the route
    """

    speed: float = math.nan
    under_way: bool = False
    route: tuple[tuple[float, float], ...] = ()
    delay: float = 0.0
    ending: Ending = Ending.STAND


def write_script(
    robot_pose: FloatArray, poses: FloatArray, walks: list[Walk], config: EnvConfig, floor: Floor
) -> Script:
    """The script of a scene with a given start: in the warm-up the robot stands, and people under way walk straight.

    Args:
        poses: (num_people, 3) at the start
    """
    rows = config.warm_up_steps + 1
    ages = config.control_period * np.arange(rows - 1, -1, -1)
    people = np.repeat(poses[None], rows, axis=0)
    velocities = np.zeros((len(poses), 3))
    for index, (pose, walk) in enumerate(zip(poses, walks, strict=True)):
        if not walk.under_way:
            continue
        direction = np.array([math.cos(pose[2]), math.sin(pose[2])])
        behind = floor.free_way(pose[:2], -direction, walk.speed * config.warm_up, config.people.radius)
        back = np.minimum(walk.speed * ages, behind)
        people[:, index, :2] -= back[:, None] * direction
        velocities[index, :2] = walk.speed * direction if behind > STANDING_BACK or rows == 1 else 0.0
    return Script(
        robot_poses=np.repeat(robot_pose[None], rows, axis=0),
        commands=np.zeros((rows - 1, 3)),
        people_poses=people,
        velocities=velocities,
        **orders_of(walks),
    )


def orders_of(walks: list[Walk]) -> dict[str, Any]:
    """The arrays of a script that hold people's walks."""
    longest = max((len(walk.route) for walk in walks), default=0)
    routes = np.full((len(walks), longest, 2), np.nan)
    for row, walk in zip(routes, walks, strict=True):
        row[: len(walk.route)] = np.array(walk.route).reshape(-1, 2)
    return {
        "speeds": np.array([walk.speed for walk in walks], dtype=np.float64),
        "routes": routes,
        "delays": np.array([walk.delay for walk in walks], dtype=np.float64),
        "endings": np.array([walk.ending for walk in walks], dtype=np.int64),
    }
