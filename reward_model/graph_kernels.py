"""The arithmetic of `reward_model.graph`, compiled: features and links of one snapshot, written in place.

Columns are those of the published layout: 0 type, 5 time, 8 person, 17 robot, 19 object, 30 room, 32 wall,
38 goal. Types and relations are literal numbers here because compiled code reads no enumerations.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from reward_model.jit import njit
from reward_model.scenario import FloatArray, IntArray

Float32Array = NDArray[np.float32]
Int32Array = NDArray[np.int32]

_NEAR_WALL = 1.5  # m from a person to the midpoint of a segment they are joined to
_ADVANCE_SCALE = 9.4 / 3.5  # 1/(m/s): the fastest command seen becomes 1
_TURN_SCALE = -10.32 / 4.0  # 1/(rad/s): likewise, and clockwise


@njit
def fill_room(features: Float32Array, command: FloatArray, num_people: int) -> None:
    """The room's row: the robot's command and how crowded the room is."""
    features[0, 2] = 1.0
    features[0, 17] = command[0] * _ADVANCE_SCALE
    features[0, 18] = command[2] * _TURN_SCALE
    features[0, 30] = num_people / 15.0
    features[0, 31] = num_people * num_people / 225.0


@njit
def fill_entities(
    features: Float32Array,
    first: int,
    kind: int,
    column: int,
    poses: FloatArray,
    velocities: FloatArray,
    interval: float,
) -> None:
    """Rows of people (9 features from `column` on) or of objects (11, with two left for the size)."""
    for index in range(len(poses)):
        row = features[first + index]
        x, y, heading = poses[index, 0] / 10.0, poses[index, 1] / 10.0, poses[index, 2]
        distance = np.hypot(x, y)
        row[kind] = 1.0
        row[column] = -y
        row[column + 1] = x
        row[column + 2] = -velocities[index, 2] * interval / 10.0
        row[column + 3] = velocities[index, 1] * interval / 10.0
        row[column + 4] = -velocities[index, 0] * interval / 10.0
        row[column + 5] = -np.cos(heading)
        row[column + 6] = -np.sin(heading)
        last = column + 7 if kind == 0 else column + 9
        row[last] = distance
        row[last + 1] = 1.0 - distance


@njit
def fill_sizes(features: Float32Array, first: int, sizes: FloatArray) -> None:
    """The sizes in the objects' rows [m]."""
    for index in range(len(sizes)):
        features[first + index, 26] = sizes[index, 0]
        features[first + index, 27] = sizes[index, 1]


@njit
def fill_goal_and_walls(
    features: Float32Array, goal_row: int, goal: FloatArray, walls: FloatArray, segments: IntArray
) -> FloatArray:
    """Rows of the goal and the wall segments; returns the segments' midpoints (num_segments, 2) [m]."""
    distance = np.hypot(goal[0], goal[1]) / 10.0
    features[goal_row, 4] = 1.0
    features[goal_row, 38] = -goal[1] / 10.0
    features[goal_row, 39] = goal[0] / 10.0
    features[goal_row, 40] = distance
    features[goal_row, 41] = 1.0 - distance
    midpoints = np.empty((segments.sum(), 2))
    index = 0
    for wall in range(len(walls)):
        dx, dy = walls[wall, 2] - walls[wall, 0], walls[wall, 3] - walls[wall, 1]
        length = max(np.hypot(dx, dy), 1e-12)
        for segment in range(segments[wall]):
            share = (segment + 0.5) / segments[wall]
            x, y = walls[wall, 0] + share * dx, walls[wall, 1] + share * dy
            midpoints[index, 0], midpoints[index, 1] = x, y
            distance = np.hypot(x, y) / 10.0
            row = features[goal_row + 1 + index]
            row[3] = 1.0
            row[32] = -y / 10.0
            row[33] = x / 10.0
            row[34] = -dy / length
            row[35] = dx / length
            row[36] = distance
            row[37] = 1.0 - distance
            index += 1
    return midpoints


@njit
def fill_lengths(
    lengths: Float32Array, people: FloatArray, objects: FloatArray, goal: FloatArray, midpoints: FloatArray
) -> None:
    """Every node's distance from the robot [dam], in node order."""
    node = 1
    for index in range(len(people)):
        lengths[node] = np.hypot(people[index, 0], people[index, 1]) / 10.0
        node += 1
    for index in range(len(objects)):
        lengths[node] = np.hypot(objects[index, 0], objects[index, 1]) / 10.0
        node += 1
    lengths[node] = np.hypot(goal[0], goal[1]) / 10.0
    node += 1
    for index in range(len(midpoints)):
        lengths[node] = np.hypot(midpoints[index, 0], midpoints[index, 1]) / 10.0
        node += 1


@njit
def _position_of(ids: IntArray, identity: int) -> int:
    for index in range(len(ids)):
        if ids[index] == identity:
            return index
    return -1


@njit
def links(
    people: FloatArray,
    objects: FloatArray,
    ids: IntArray,
    pairs: IntArray,
    midpoints: FloatArray,
    first_wall: int,
) -> tuple[Int32Array, Int32Array, Int32Array, Float32Array]:
    """Both directions of every interaction and of every person near a wall segment.

    A first relation of -1 reports an interaction between two objects.
    """
    room = 2 * (len(pairs) + len(people) * len(midpoints))
    sources, targets = np.empty(room, dtype=np.int32), np.empty(room, dtype=np.int32)
    relations, lengths = np.empty(room, dtype=np.int32), np.empty(room, dtype=np.float32)
    count = 0
    for pair in range(len(pairs)):
        first, second = _position_of(ids, pairs[pair, 0]), _position_of(ids, pairs[pair, 1])
        a = people[first] if first < len(people) else objects[first - len(people)]
        b = people[second] if second < len(people) else objects[second - len(people)]
        forward, backward = 4, 4  # person and person
        if first >= len(people) and second >= len(people):
            relations[0] = -1
            return sources[:1], targets[:1], relations[:1], lengths[:1]
        if first >= len(people):
            forward, backward = 1, 3  # object to person
        elif second >= len(people):
            forward, backward = 3, 1  # person to object
        sources[count], targets[count], relations[count] = 1 + first, 1 + second, forward
        sources[count + 1], targets[count + 1], relations[count + 1] = 1 + second, 1 + first, backward
        lengths[count : count + 2] = np.hypot(a[0] - b[0], a[1] - b[1]) / 10.0
        count += 2
    for person in range(len(people)):
        for wall in range(len(midpoints)):
            distance = np.hypot(people[person, 0] - midpoints[wall, 0], people[person, 1] - midpoints[wall, 1])
            if distance < _NEAR_WALL:
                sources[count], targets[count], relations[count] = 1 + person, first_wall + wall, 6
                sources[count + 1], targets[count + 1], relations[count + 1] = (
                    first_wall + wall,
                    1 + person,
                    12,
                )
                lengths[count : count + 2] = distance
                count += 2
    return sources[:count].copy(), targets[:count].copy(), relations[:count].copy(), lengths[:count].copy()
