"""The initial layout of an episode: the room, and the poses of people and objects. Plain arrays, no behaviour.

World frame: SI units, REP-103 (angles counter-clockwise from the x axis).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property

import numpy as np

from reward_model.base.arrays import BoolArray, FloatArray, IntArray


class ObjectKind(IntEnum):
    """The kind of an object."""

    TABLE = 0
    LAPTOP = 1  # stands on a table, at the table's pose
    PLANT = 2


@dataclass(frozen=True, eq=False)
class Room:
    """A closed room.

    Attributes:
        corners: (num_corners, 2) [m], counter-clockwise, without repeating the first one; wall i runs from corner i to
            corner i + 1
    """

    corners: FloatArray

    @cached_property
    def walls(self) -> FloatArray:
        """(num_walls, 4) x1, y1, x2, y2 [m], read-only."""
        return np.hstack([self.corners, np.roll(self.corners, -1, axis=0)])


class Ending(IntEnum):
    """A person's behaviour at the end of their route."""

    STAND = 0  # stays there
    WANDER = 1  # goes on to places of their own choice, as people without a route do
    REPEAT = 2  # walks the route again, from its first place


@dataclass(frozen=True, eq=False)
class Script:
    """A scenario's warm-up, which is given and not simulated, and people's routes.

    Attributes:
        robot_poses: (warm_up_steps + 1, 3) of the robot from the beginning of the warm-up to the start of the episode
        commands: (warm_up_steps, 3) its commands: forward [m/s], to the left [m/s], turn rate [rad/s]
        people_poses: (warm_up_steps + 1, num_people, 3)
        velocities: (num_people, 3) of people at the start [m/s, m/s, rad/s]
        speeds: (num_people,) desired speeds [m/s]; NaN: drawn
        routes: (num_people, longest, 2) [m] places to walk to, one after the other; NaN from a route's end on
        delays: (num_people,) [s] waiting times from the start to the route
        endings: (num_people,) of `Ending`
    """

    robot_poses: FloatArray
    commands: FloatArray
    people_poses: FloatArray
    velocities: FloatArray
    speeds: FloatArray
    routes: FloatArray
    delays: FloatArray
    endings: IntArray


@dataclass(frozen=True, eq=False)
class Layout:
    """The initial state of an episode.

    Attributes:
        robot_pose: (3,) x [m], y [m], heading [rad]
        goal: (2,) [m]
        people_poses: (num_people, 3)
        people_walk: (num_people,) whether a person walks (True) or stands where they are (False)
        people_group: (num_people,) people with the same number walk together; -1 for people on their own
        object_poses: (num_objects, 3)
        object_sizes: (num_objects, 2) width along the object's own x axis and depth along its y axis [m]
        object_kinds: (num_objects,) of `ObjectKind`
        interaction_pairs: (num_interactions, 2) entity indices: people count from 0, objects on from num_people
        interaction_relations: one name each, as in SocNav2
        script: of a scenario; None: the warm-up is simulated and people wander
    """

    room: Room
    robot_pose: FloatArray
    goal: FloatArray
    people_poses: FloatArray
    people_walk: BoolArray
    people_group: IntArray
    object_poses: FloatArray
    object_sizes: FloatArray
    object_kinds: IntArray
    interaction_pairs: IntArray
    interaction_relations: tuple[str, ...]
    script: Script | None = None

    @property
    def num_people(self) -> int:
        """The number of people in the room."""
        return len(self.people_poses)

    @property
    def num_objects(self) -> int:
        """The number of objects in the room; a table with a laptop counts as two."""
        return len(self.object_poses)
