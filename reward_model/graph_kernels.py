"""The arithmetic of `reward_model.graph`, compiled: one snapshot's arrays from its numbers, in one call.

Columns are those of the published layout: 0 type, 5 time, 8 person, 17 robot, 19 object, 30 room, 32 wall,
38 goal. Types and relations are literal numbers here because compiled code reads no enumerations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from reward_model.jit import njit
from reward_model.scenario import FloatArray, IntArray

Float32Array = NDArray[np.float32]
Int32Array = NDArray[np.int32]

_NUM_FEATURES = 42
_NEAR_WALL = 1.5  # m from a person to the midpoint of a segment they are joined to
_ADVANCE_SCALE = 9.4 / 3.5  # 1/(m/s): the fastest command seen becomes 1
_TURN_SCALE = -10.32 / 4.0  # 1/(rad/s): likewise, and clockwise
_ROOM_KEY = np.iinfo(np.int64).min  # room, goal and segments lie below every id that fits in 62 bits


class Entities(NamedTuple):
    """People or objects: ids (n,), poses (n, 3) and velocities (n, 3) as in a `Snapshot`."""

    ids: IntArray
    poses: FloatArray
    velocities: FloatArray


class FrameArrays(NamedTuple):
    """The arrays of a `FrameGraph`, in its order."""

    features: Float32Array
    kinds: Int32Array
    keys: IntArray
    lengths: Float32Array
    link_sources: Int32Array
    link_targets: Int32Array
    link_relations: Int32Array
    link_lengths: Float32Array


@njit
def frame_arrays(
    people: Entities,
    objects: Entities,
    sizes: FloatArray,
    command: FloatArray,
    goal: FloatArray,
    walls: FloatArray,
    segments: IntArray,
    pairs: IntArray,
    interval: float,
) -> FrameArrays:
    """Nodes and links of one snapshot; a link relation of -1 reports an interaction between two objects.

    sizes: (num_objects, 2); segments: (num_walls,); pairs: (num_interactions, 2) ids; interval: [s]
    """
    first_object = 1 + len(people.ids)
    goal_node = first_object + len(objects.ids)
    num_nodes = goal_node + 1 + segments.sum()
    features = np.zeros((num_nodes, _NUM_FEATURES), dtype=np.float32)
    kinds, keys = np.empty(num_nodes, dtype=np.int32), np.empty(num_nodes, dtype=np.int64)
    lengths = np.zeros(num_nodes, dtype=np.float32)
    _name_nodes(kinds, keys, people.ids, objects.ids)
    _fill_room(features, command, len(people.ids))
    _fill_entities(features, lengths, 1, 0, 8, people, interval)
    _fill_entities(features, lengths, first_object, 1, 19, objects, interval)
    features[first_object:goal_node, 26:28] = sizes
    _fill_goal(features, lengths, goal_node, goal)
    midpoints = _fill_walls(features, lengths, goal_node + 1, walls, segments)
    sources, targets, relations, link_lengths = _links(people, objects, pairs, midpoints, goal_node + 1)
    return FrameArrays(features, kinds, keys, lengths, sources, targets, relations, link_lengths)


@njit
def _name_nodes(kinds: Int32Array, keys: IntArray, people: IntArray, objects: IntArray) -> None:
    """What each node stands for, and the name by which it is found again in another frame."""
    first_object, goal = 1 + len(people), 1 + len(people) + len(objects)
    kinds[0], kinds[goal] = 2, 4
    kinds[1:first_object], kinds[first_object:goal], kinds[goal + 1 :] = 0, 1, 3
    keys[0] = _ROOM_KEY
    keys[1:first_object], keys[first_object:goal] = people, objects
    for node in range(goal, len(keys)):
        keys[node] = _ROOM_KEY + 1 + node - goal


@njit
def _fill_room(features: Float32Array, command: FloatArray, num_people: int) -> None:
    """The room's row: the robot's command and how crowded the room is."""
    features[0, 2] = 1.0
    features[0, 17] = command[0] * _ADVANCE_SCALE
    features[0, 18] = command[2] * _TURN_SCALE
    features[0, 30] = num_people / 15.0
    features[0, 31] = num_people * num_people / 225.0


@njit
def _fill_entities(
    features: Float32Array,
    lengths: Float32Array,
    first: int,
    kind: int,
    column: int,
    entities: Entities,
    interval: float,
) -> None:
    """Rows of people (9 features from `column` on) or of objects (11, with two left for the size)."""
    poses, velocities = entities.poses, entities.velocities
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
        lengths[first + index] = np.hypot(poses[index, 0], poses[index, 1]) / 10.0


@njit
def _fill_goal(features: Float32Array, lengths: Float32Array, node: int, goal: FloatArray) -> None:
    distance = np.hypot(goal[0], goal[1]) / 10.0
    row = features[node]
    row[4] = 1.0
    row[38] = -goal[1] / 10.0
    row[39] = goal[0] / 10.0
    row[40] = distance
    row[41] = 1.0 - distance
    lengths[node] = distance


@njit
def _fill_walls(
    features: Float32Array, lengths: Float32Array, first: int, walls: FloatArray, segments: IntArray
) -> FloatArray:
    """Rows of the wall segments; returns the segments' midpoints (num_segments, 2) [m]."""
    midpoints = np.empty((len(features) - first, 2))
    index = 0
    for wall in range(len(walls)):
        dx, dy = walls[wall, 2] - walls[wall, 0], walls[wall, 3] - walls[wall, 1]
        length = max(np.hypot(dx, dy), 1e-12)
        for segment in range(segments[wall]):
            share = (segment + 0.5) / segments[wall]
            x, y = walls[wall, 0] + share * dx, walls[wall, 1] + share * dy
            midpoints[index, 0], midpoints[index, 1] = x, y
            distance = np.hypot(x, y) / 10.0
            row = features[first + index]
            row[3] = 1.0
            row[32] = -y / 10.0
            row[33] = x / 10.0
            row[34] = -dy / length
            row[35] = dx / length
            row[36] = distance
            row[37] = 1.0 - distance
            lengths[first + index] = distance
            index += 1
    return midpoints


@njit
def _links(
    people: Entities, objects: Entities, pairs: IntArray, midpoints: FloatArray, first_wall: int
) -> tuple[Int32Array, Int32Array, Int32Array, Float32Array]:
    """Both directions of every interaction and of every person near a wall segment."""
    room = 2 * (len(pairs) + len(people.ids) * len(midpoints))
    sources, targets = np.empty(room, dtype=np.int32), np.empty(room, dtype=np.int32)
    relations, lengths = np.empty(room, dtype=np.int32), np.empty(room, dtype=np.float32)
    count = 0
    for pair in range(len(pairs)):
        if _named_before(pairs, pair):
            continue
        first, second = _place(people.ids, objects.ids, pairs[pair, 0]), _place(people.ids, objects.ids, pairs[pair, 1])
        forward, backward = _interaction_relations(first < len(people.ids), second < len(people.ids))
        a, b = _position(people, objects, first), _position(people, objects, second)
        relations[count], relations[count + 1] = forward, backward
        sources[count], targets[count] = 1 + first, 1 + second
        sources[count + 1], targets[count + 1] = 1 + second, 1 + first
        lengths[count : count + 2] = np.hypot(a[0] - b[0], a[1] - b[1]) / 10.0
        count += 2
    for person in range(len(people.ids)):
        x, y = people.poses[person, 0], people.poses[person, 1]
        for wall in range(len(midpoints)):
            distance = np.hypot(x - midpoints[wall, 0], y - midpoints[wall, 1])
            if distance < _NEAR_WALL:
                relations[count], relations[count + 1] = 6, 12
                sources[count], targets[count] = 1 + person, first_wall + wall
                sources[count + 1], targets[count + 1] = first_wall + wall, 1 + person
                lengths[count : count + 2] = distance
                count += 2
    return sources[:count].copy(), targets[:count].copy(), relations[:count].copy(), lengths[:count].copy()


@njit
def _interaction_relations(first_is_person: bool, second_is_person: bool) -> tuple[int, int]:
    """The relations there and back; -1 between two objects, for which there is none."""
    if first_is_person and second_is_person:
        return 4, 4
    if first_is_person:
        return 3, 1  # to an object and from it
    if second_is_person:
        return 1, 3
    return -1, -1


@njit
def _named_before(pairs: IntArray, place: int) -> bool:
    """Whether two were joined already, either way round."""
    a, b = pairs[place]
    for earlier in range(place):
        c, d = pairs[earlier]
        if (a == c and b == d) or (a == d and b == c):
            return True
    return False


@njit
def _place(people: IntArray, objects: IntArray, identity: int) -> int:
    """Where an id stands among people, then objects; it is there, as `Sequence` has made sure."""
    for index in range(len(people)):
        if people[index] == identity:
            return index
    for index in range(len(objects)):
        if objects[index] == identity:
            return len(people) + index
    return -1


@njit
def _position(people: Entities, objects: Entities, place: int) -> FloatArray:
    entities, index = (people, place) if place < len(people.ids) else (objects, place - len(people.ids))
    pose: FloatArray = entities.poses[index]
    return pose
