"""Compiled code that makes a snapshot's packed frame in one call, for `reward_model.graph.windows`.

Columns are those of `reward_model.graph.packing`; a kind's own features begin at `OWN`, in the published order. Kinds
and relations are literal numbers here because compiled code cannot read enumerations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from reward_model.base.arrays import Float32Array, FloatArray, Int32Array, IntArray
from reward_model.base.numba import njit
from reward_model.graph.features import OWN
from reward_model.graph.packing import empty_words, views

_NEAR_WALL = 1.5  # m, below this distance a person is joined to a segment's midpoint
_ADVANCE_SCALE = 9.4 / 3.5  # 1/(m/s): the fastest command in the data becomes 1
_TURN_SCALE = -10.32 / 4.0  # 1/(rad/s): likewise, and clockwise
_FARTHEST = 1e9  # m, of walls where the distance to them is computed
_ROOM_KEY = np.iinfo(np.int64).min  # keys of room, goal and segments are below every id that fits in 62 bits


class Entities(NamedTuple):
    """People or objects: ids (n,), poses (n, 3) and velocities (n, 3) as in a `Snapshot`."""

    ids: IntArray
    poses: FloatArray
    velocities: FloatArray


class _Links(NamedTuple):
    """Sources, targets, relations and lengths, (num_links,) each."""

    sources: Int32Array
    targets: Int32Array
    relations: Int32Array
    lengths: Float32Array


@njit
def packed_frame(
    people: Entities,
    objects: Entities,
    sizes: FloatArray,
    command: FloatArray,
    goal: FloatArray,
    walls: FloatArray,
    segments: IntArray,
    pairs: IntArray,
    interval: float,
) -> Int32Array:
    """Nodes and links of one snapshot, packed; a link relation of -1 marks an interaction between two objects.

    Args:
        sizes: (num_objects, 2)
        segments: (num_walls,)
        pairs: (num_interactions, 2) ids
        interval: [s]
    """
    first_object = 1 + len(people.ids)
    goal_node = first_object + len(objects.ids)
    midpoints, directions = _segments(walls, segments)
    links = _links(people, objects, pairs, midpoints, goal_node + 1)
    words = empty_words(goal_node + 1 + len(midpoints), len(links.lengths))
    frame = views(words)
    features, lengths = frame.features, frame.lengths
    _name_nodes(frame.kinds, frame.keys, people.ids, objects.ids)
    features[:, 0] = 1.0
    _fill_room(features, lengths, command, len(people.ids))
    _fill_entities(features, lengths, 1, 0, people, interval)
    _fill_entities(features, lengths, first_object, 1, objects, interval)
    features[first_object:goal_node, OWN + 7 : OWN + 9] = sizes
    _fill_goal(features, lengths, goal_node, goal)
    _fill_walls(features, lengths, goal_node + 1, midpoints, directions)
    frame.link_sources[:], frame.link_targets[:] = links.sources, links.targets
    frame.link_relations[:], frame.link_lengths[:] = links.relations, links.lengths
    _fill_surroundings(frame.surroundings, people.poses, objects.poses, sizes, walls)
    return words


@njit
def _fill_surroundings(
    out: Float32Array, people: FloatArray, objects: FloatArray, sizes: FloatArray, walls: FloatArray
) -> None:
    """Fill the fields of `reward_model.graph.frame.Surroundings`."""
    out[:3] = np.inf
    for person in range(len(people)):
        out[0] = min(out[0], np.hypot(people[person, 0], people[person, 1]))
    for index in range(len(objects)):
        x, y, heading = objects[index]
        along, across = np.cos(heading) * x + np.sin(heading) * y, np.cos(heading) * y - np.sin(heading) * x
        ahead, beside = abs(along) - sizes[index, 0] / 2.0, abs(across) - sizes[index, 1] / 2.0
        out[1] = min(out[1], np.hypot(max(ahead, 0.0), max(beside, 0.0)))
    for wall in range(len(walls)):
        x, y = _limited(walls[wall, 0]), _limited(walls[wall, 1])
        dx, dy = _limited(walls[wall, 2]) - x, _limited(walls[wall, 3]) - y
        share = min(max(-(x * dx + y * dy) / max(dx * dx + dy * dy, 1e-12), 0.0), 1.0)
        out[2] = min(out[2], np.hypot(x + share * dx, y + share * dy))
    out[3] = _extent(walls)


@njit
def _limited(coordinate: float) -> float:
    """The coordinate within +-`_FARTHEST`, so that squares are finite."""
    return min(max(coordinate, -_FARTHEST), _FARTHEST)


@njit
def _extent(walls: FloatArray) -> float:
    """[m] the larger of all walls' widths along the longest wall and across it."""
    longest, cos, sin = 0.0, 1.0, 0.0
    for wall in range(len(walls)):
        dx, dy = walls[wall, 2] - walls[wall, 0], walls[wall, 3] - walls[wall, 1]
        length = np.hypot(dx, dy)
        if length > longest and np.isfinite(length):
            longest, cos, sin = length, dx / length, dy / length
    extent = 0.0
    for _ in range(2 if len(walls) else 0):
        low, high = np.inf, -np.inf
        for wall in range(len(walls)):
            for end in range(0, 4, 2):
                place = cos * walls[wall, end] + sin * walls[wall, end + 1]
                low, high = min(low, place), max(high, place)
        extent = max(extent, high - low)
        cos, sin = -sin, cos
    return extent


@njit
def _name_nodes(kinds: Int32Array, keys: IntArray, people: IntArray, objects: IntArray) -> None:
    """Write the kind of each node, and the key that identifies it in other frames."""
    first_object, goal = 1 + len(people), 1 + len(people) + len(objects)
    kinds[0], kinds[goal] = 2, 4
    kinds[1:first_object], kinds[first_object:goal], kinds[goal + 1 :] = 0, 1, 3
    keys[0] = _ROOM_KEY
    keys[1:first_object], keys[first_object:goal] = people, objects
    for node in range(goal, len(keys)):
        keys[node] = _ROOM_KEY + 1 + node - goal


@njit
def _fill_room(features: Float32Array, lengths: Float32Array, command: FloatArray, num_people: int) -> None:
    """Fill the room's row: the robot's command and the number of people."""
    features[0, OWN] = command[0] * _ADVANCE_SCALE
    features[0, OWN + 1] = command[2] * _TURN_SCALE
    features[0, OWN + 2] = num_people / 15.0
    features[0, OWN + 3] = num_people * num_people / 225.0
    lengths[0] = 0.0


@njit
def _fill_entities(
    features: Float32Array,
    lengths: Float32Array,
    first: int,
    kind: int,
    entities: Entities,
    interval: float,
) -> None:
    """Fill the rows of people (9 features) or of objects (11, two of which are left for the size)."""
    poses, velocities = entities.poses, entities.velocities
    for index in range(len(poses)):
        row = features[first + index]
        x, y, heading = poses[index, 0] / 10.0, poses[index, 1] / 10.0, poses[index, 2]
        distance = np.hypot(x, y)
        row[OWN] = -y
        row[OWN + 1] = x
        row[OWN + 2] = -velocities[index, 2] * interval / 10.0
        row[OWN + 3] = velocities[index, 1] * interval / 10.0
        row[OWN + 4] = -velocities[index, 0] * interval / 10.0
        row[OWN + 5] = -np.cos(heading)
        row[OWN + 6] = -np.sin(heading)
        last = OWN + 7 if kind == 0 else OWN + 9
        row[last] = distance
        row[last + 1] = 1.0 - distance
        lengths[first + index] = np.hypot(poses[index, 0], poses[index, 1]) / 10.0


@njit
def _fill_goal(features: Float32Array, lengths: Float32Array, node: int, goal: FloatArray) -> None:
    distance = np.hypot(goal[0], goal[1]) / 10.0
    row = features[node]
    row[OWN] = -goal[1] / 10.0
    row[OWN + 1] = goal[0] / 10.0
    row[OWN + 2] = distance
    row[OWN + 3] = 1.0 - distance
    lengths[node] = distance


@njit
def _segments(walls: FloatArray, segments: IntArray) -> tuple[FloatArray, FloatArray]:
    """Midpoints [m] and directions of the walls' segments, (num_segments, 2) each."""
    midpoints, directions = np.empty((segments.sum(), 2)), np.empty((segments.sum(), 2))
    index = 0
    for wall in range(len(walls)):
        dx, dy = walls[wall, 2] - walls[wall, 0], walls[wall, 3] - walls[wall, 1]
        length = max(np.hypot(dx, dy), 1e-12)
        for segment in range(segments[wall]):
            share = (segment + 0.5) / segments[wall]
            midpoints[index, 0], midpoints[index, 1] = walls[wall, 0] + share * dx, walls[wall, 1] + share * dy
            directions[index, 0], directions[index, 1] = dx / length, dy / length
            index += 1
    return midpoints, directions


@njit
def _fill_walls(
    features: Float32Array, lengths: Float32Array, first: int, midpoints: FloatArray, directions: FloatArray
) -> None:
    """Fill the rows of the wall segments."""
    for index in range(len(midpoints)):
        x, y = midpoints[index]
        distance = np.hypot(x, y) / 10.0
        row = features[first + index]
        row[OWN] = -y / 10.0
        row[OWN + 1] = x / 10.0
        row[OWN + 2] = -directions[index, 1]
        row[OWN + 3] = directions[index, 0]
        row[OWN + 4] = distance
        row[OWN + 5] = 1.0 - distance
        lengths[first + index] = distance


@njit
def _links(people: Entities, objects: Entities, pairs: IntArray, midpoints: FloatArray, first_wall: int) -> _Links:
    """Both directions of every interaction, and of every pair of a person and a wall segment near them."""
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
    return _Links(sources[:count], targets[:count], relations[:count], lengths[:count])


@njit
def _interaction_relations(first_is_person: bool, second_is_person: bool) -> tuple[int, int]:
    """The relations of both directions; -1 between two objects, which have none."""
    if first_is_person and second_is_person:
        return 4, 4
    if first_is_person:
        return 3, 1  # to an object and from it
    if second_is_person:
        return 1, 3
    return -1, -1


@njit
def _named_before(pairs: IntArray, place: int) -> bool:
    """Whether an earlier pair is the same, in either direction."""
    a, b = pairs[place]
    for earlier in range(place):
        c, d = pairs[earlier]
        if (a == c and b == d) or (a == d and b == c):
            return True
    return False


@njit
def _place(people: IntArray, objects: IntArray, identity: int) -> int:
    """The index of an id among people, then objects; `SceneSequence` has checked that it exists."""
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
