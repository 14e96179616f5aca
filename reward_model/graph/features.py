"""The layout of the published network's graph: kinds and features of nodes, relations of edges.

One table names the features in the order of Bachiller et al.'s released network; all columns follow from it. Their
conventions are those of its training data: x to the right, y forward, clockwise angles, displacements for velocities,
decametres. Code outside this folder does not depend on them.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final

import numpy as np

LAYOUT_VERSION: Final = "socnav2-graph-1"  # changed with every change of a feature or an edge

NUM_FRAMES: Final = 3
FRAME_SPACING: Final = 1.0  # s between the frames of a window, at least


class NodeKind(IntEnum):
    """The kind of a node; the value is its place in the type one-hot."""

    PERSON = 0
    OBJECT = 1
    ROOM = 2
    WALL = 3
    GOAL = 4


class Relation(IntEnum):
    """The relation of an edge, source first; the value is its place in the relation one-hot."""

    GOAL_ROOM = 0
    OBJECT_PERSON = 1
    OBJECT_ROOM = 2
    PERSON_OBJECT = 3
    PERSON_PERSON = 4
    PERSON_ROOM = 5
    PERSON_WALL = 6
    ROOM_GOAL = 7
    ROOM_OBJECT = 8
    ROOM_PERSON = 9
    ROOM_WALL = 10
    SELF = 11
    WALL_PERSON = 12
    WALL_ROOM = 13
    NOW_TO_SECOND = 14  # from the newest frame to the one a second older
    SECOND_TO_NOW = 15
    SECOND_TO_THIRD = 16
    THIRD_TO_SECOND = 17


NUM_RELATIONS: Final = len(Relation)

# (num_kinds,) the relation of the edge between the room and a node, by the node's kind; -1 for the room itself
TO_ROOM: Final = np.array(
    [Relation.PERSON_ROOM, Relation.OBJECT_ROOM, -1, Relation.WALL_ROOM, Relation.GOAL_ROOM], dtype=np.int32
)
FROM_ROOM: Final = np.array(
    [Relation.ROOM_PERSON, Relation.ROOM_OBJECT, -1, Relation.ROOM_WALL, Relation.ROOM_GOAL], dtype=np.int32
)

NUM_EDGE_FEATURES: Final = NUM_RELATIONS  # the relation's one-hot, whose last place holds the length
LENGTH_FEATURE: Final = NUM_EDGE_FEATURES - 1

# The features behind the type and time one-hots, block by block, each with the kind of node that has it.
_POSE: Final = ("x", "y", "va", "vx", "vy", "sin a", "cos a")
_DISTANCE: Final = ("distance", "1 - distance")
_BLOCKS: Final = (
    (NodeKind.PERSON, (*_POSE, *_DISTANCE)),
    (NodeKind.ROOM, ("advance", "turn")),  # the robot's command
    (NodeKind.OBJECT, (*_POSE, "size x", "size y", *_DISTANCE)),
    (NodeKind.ROOM, ("people", "people^2")),
    (NodeKind.WALL, ("x", "y", "sin o", "cos o", *_DISTANCE)),
    (NodeKind.GOAL, ("x", "y", *_DISTANCE)),
)
# Features that change sign when left and right are swapped: positions and velocities along x, angles (a facing
# direction is (cos a, -sin a) in (right, forward), a wall's (sin o, cos o)), and turn rates.
_ODD: Final = {"x", "vx", "va", "cos a", "turn", "sin o"}

TIME_FEATURES: Final = len(NodeKind)  # the first of three: now, 1 s ago, 2 s ago
_FIRST_OWN: Final = TIME_FEATURES + NUM_FRAMES
_NAMED: Final = tuple((kind, name) for kind, names in _BLOCKS for name in names)
NUM_NODE_FEATURES: Final = _FIRST_OWN + len(_NAMED)

OWN: Final = 1 + NUM_FRAMES
"""The place of a kind's first own feature among its columns, after the type and the place in the window."""

COLUMNS: Final = tuple(
    (
        kind.value,
        *range(TIME_FEATURES, _FIRST_OWN),
        *(_FIRST_OWN + place for place, (owner, _) in enumerate(_NAMED) if owner is kind),
    )
    for kind in NodeKind
)
"""The features that nodes of each `NodeKind` can have; their others are 0."""

MIRROR_SIGNS: Final = np.ones(NUM_NODE_FEATURES, dtype=np.float32)
"""Signs (42,) under mirroring: -1 for the features that change sign when left and right are swapped, else 1."""
MIRROR_SIGNS[[_FIRST_OWN + place for place, (_, name) in enumerate(_NAMED) if name in _ODD]] = -1
MIRROR_SIGNS.setflags(write=False)

WALL_DIRECTION: Final = [_FIRST_OWN + _NAMED.index((NodeKind.WALL, name)) for name in ("sin o", "cos o")]
"""The features that change sign when a wall is listed from its other end."""
