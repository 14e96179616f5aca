"""Compiled code that reads windows of packed frames into the rows of `reward_model.graph.star`.

Numbers are read as they stand in frames, bounded so that all that follows is finite. The tables below name the
features by their place among a kind's own, see `reward_model.graph.features`.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from reward_model.base.arrays import Float32Array, Int32Array, IntArray
from reward_model.base.numba import njit
from reward_model.graph.features import OWN
from reward_model.graph.packing import NUM_PACKED, Stack, num_words, offsets

NUM_SLOTS: Final = 3  # frames of a window
NEAR, FAR = np.float32(0.05), np.float32(0.15)  # dam, over which exp(-distance / ...) falls
_BOUND = np.float32(1e3)  # dam, of any number that is read
_LEAST_SQUARE = np.float32(1e-9)  # dam^2, of the line between two
_NO_WALL = np.float32(0.15)  # dam, the wall distance of people without a wall near them: the largest of an edge

_FARTHEST = np.float32(3.0)  # m, of the distances to the closest person, object and wall
_BODY = np.float32(0.25)  # m, the robot's radius
_CLOSE = np.float32(0.15)  # m, over which the exponentials of these distances fall

# Own features that keep their sign, and those that change it, when left and right are swapped.
_EVEN = np.array([1, 4, 5])  # y, vy, sin a; and the distance
_ODD = np.array([0, 2, 3, 6])  # x, va, vx, cos a
_PERSON_DISTANCE, _OBJECT_DISTANCE, _OBJECT_SIZE, _WALL_DISTANCE, _GOAL_DISTANCE = 7, 9, 7, 4, 2

PERSON_EVEN: Final = 4 * NUM_SLOTS + 5
OBJECT_EVEN: Final = 4 * NUM_SLOTS + 4
ENTITY_ODD: Final = 4 * NUM_SLOTS
WALL_EVEN, WALL_ODD = 3 * NUM_SLOTS + 2, 2 * NUM_SLOTS
PAIR_EVEN, PAIR_ODD = 8 * NUM_SLOTS + 6, 4 * NUM_SLOTS + 2
ROOM_EVEN, ROOM_ODD = 9 * NUM_SLOTS + 8, 2 * NUM_SLOTS

PEOPLE, OBJECTS, WALLS, PAIRS = 0, 1, 2, 3  # columns of the counts


class Rows(NamedTuple):
    """See `reward_model.graph.star.Stars`."""

    people: Float32Array
    objects: Float32Array
    walls: Float32Array
    pairs: Float32Array
    rooms: Float32Array
    counts: IntArray
    surroundings: Float32Array


@njit
def star_rows(stack: Stack) -> Rows:
    """The rows of all windows, one window after the other."""
    counts = _counts(stack)
    totals = counts.sum(axis=0)
    rows = Rows(
        np.empty((totals[PEOPLE], PERSON_EVEN + ENTITY_ODD), dtype=np.float32),
        np.empty((totals[OBJECTS], OBJECT_EVEN + ENTITY_ODD), dtype=np.float32),
        np.empty((totals[WALLS], WALL_EVEN + WALL_ODD), dtype=np.float32),
        np.empty((totals[PAIRS], PAIR_EVEN + PAIR_ODD), dtype=np.float32),
        np.empty((len(counts), ROOM_EVEN + ROOM_ODD), dtype=np.float32),
        counts,
        np.empty((len(counts), 4), dtype=np.float32),
    )
    firsts = np.zeros(4, dtype=np.int64)
    starts = np.zeros(NUM_SLOTS, dtype=np.int64)
    start = 0
    for window in range(len(counts)):
        for time in range(NUM_SLOTS):
            if time < stack.sizes[window]:
                starts[time] = start
                start += num_words(stack.words, start)
            else:
                starts[time] = starts[time - 1]
        _fill_window(stack.words, starts, rows, window, firsts)
        firsts += counts[window]
    return rows


@njit
def _counts(stack: Stack) -> IntArray:
    """(num_windows, 4) people, objects, wall segments and pairs in each window's newest frame."""
    counts = np.zeros((len(stack.sizes), 4), dtype=np.int64)
    start = 0
    for window in range(len(stack.sizes)):
        words, at = stack.words, offsets(stack.words, start)
        for node in range(words[start]):
            kind = words[at.kinds + node]
            if kind == 0:
                counts[window, PEOPLE] += 1
            elif kind == 1:
                counts[window, OBJECTS] += 1
            elif kind == 3:
                counts[window, WALLS] += 1
        for link in range(words[start + 1]):
            if _is_pair(words[at.link_relations + link]):
                counts[window, PAIRS] += 1
        for _ in range(stack.sizes[window]):
            start += num_words(stack.words, start)
    return counts


@njit
def _is_pair(relation: int) -> bool:
    """Whether an edge goes from a person to who or what they interact with."""
    return relation == 3 or relation == 4


@njit
def _fill_window(words: Int32Array, starts: IntArray, rows: Rows, window: int, firsts: IntArray) -> None:
    numbers = words.view(np.float32)
    at = offsets(words, starts[0])
    row_of = np.empty(words[starts[0]], dtype=np.int64)
    person, thing, wall = firsts[PEOPLE], firsts[OBJECTS], firsts[WALLS]
    found, following = np.empty(NUM_SLOTS, dtype=np.int64), np.zeros(NUM_SLOTS, dtype=np.int64)
    room, goal = np.empty(NUM_SLOTS, dtype=np.int64), np.empty(NUM_SLOTS, dtype=np.int64)
    for node in range(words[starts[0]]):
        kind = words[at.kinds + node]
        _find_features(words, starts, node, following, found)
        if kind == 0:
            row_of[node] = person
            row = rows.people[person]
            _fill_entity(numbers, found, _PERSON_DISTANCE, row, PERSON_EVEN)
            row[PERSON_EVEN - 5], row[PERSON_EVEN - 4], row[PERSON_EVEN - 3] = _NO_WALL, 0.0, 0.0
            _fill_nearness(row, PERSON_EVEN - 2, row[3])
            person += 1
        elif kind == 1:
            row_of[node] = thing
            row = rows.objects[thing]
            _fill_entity(numbers, found, _OBJECT_DISTANCE, row, OBJECT_EVEN)
            for axis in range(2):
                row[OBJECT_EVEN - 4 + axis] = _bounded(numbers[found[0] + _OBJECT_SIZE + axis])
            _fill_nearness(row, OBJECT_EVEN - 2, row[3])
            thing += 1
        elif kind == 3:
            _fill_wall(numbers, found, rows.walls[wall])
            wall += 1
        elif kind == 2:
            room[:] = found
        else:
            goal[:] = found
    _fill_links(words, starts[0], row_of, rows, firsts)
    row = rows.rooms[window]
    _fill_room(numbers, room, goal, row, rows.counts[window])
    for time in range(NUM_SLOTS):
        around = offsets(words, starts[time]).surroundings
        for kind in range(3):
            place, distance = ROOM_EVEN - 6 * (NUM_SLOTS - time) + 2 * kind, numbers[around + kind]
            row[place] = min(distance, _FARTHEST)
            row[place + 1] = np.exp((_BODY - distance) / _CLOSE)
    rows.surroundings[window] = numbers[at.surroundings : at.surroundings + 4]


@njit
def _find_features(words: Int32Array, starts: IntArray, node: int, following: IntArray, found: IntArray) -> None:
    """Find where an entity's own features begin in each frame; in one without it, they are those of the newer frame.

    Most often it comes right after the one found before, `following`.
    """
    keys = words.view(np.int64)  # frames have an even number of words
    first = offsets(words, starts[0])
    key = keys[first.keys // 2 + node]
    found[0] = first.features + node * NUM_PACKED + OWN
    for time in range(1, NUM_SLOTS):
        at, num_nodes, place = offsets(words, starts[time]), words[starts[time]], following[time]
        if place >= num_nodes or keys[at.keys // 2 + place] != key:
            place = 0
            while place < num_nodes and keys[at.keys // 2 + place] != key:
                place += 1
        if place < num_nodes:
            found[time] = at.features + place * NUM_PACKED + OWN
            following[time] = place + 1
        else:
            found[time] = found[time - 1]


@njit
def _bounded(number: np.float32) -> np.float32:
    return min(max(number, -_BOUND), _BOUND)


@njit
def _fill_nearness(row: Float32Array, place: int, distance: np.float32) -> None:
    row[place], row[place + 1] = np.exp(-distance / NEAR), np.exp(-distance / FAR)


@njit
def _fill_entity(numbers: Float32Array, found: IntArray, distance: int, row: Float32Array, odd: int) -> None:
    """Fill what a person's and an object's rows have in common; the distance now is column 3."""
    for time in range(NUM_SLOTS):
        start = found[time]
        for index in range(3):
            row[4 * time + index] = _bounded(numbers[start + _EVEN[index]])
        row[4 * time + 3] = _bounded(numbers[start + distance])
        for index in range(4):
            row[odd + 4 * time + index] = _bounded(numbers[start + _ODD[index]])


@njit
def _fill_wall(numbers: Float32Array, found: IntArray, row: Float32Array) -> None:
    """Twice the angle of a segment is the same from both of its ends."""
    for time in range(NUM_SLOTS):
        start = found[time]
        sin, cos = numbers[start + 2], numbers[start + 3]
        row[3 * time] = _bounded(numbers[start + 1])
        row[3 * time + 1] = cos * cos - sin * sin
        row[3 * time + 2] = _bounded(numbers[start + _WALL_DISTANCE])
        row[WALL_EVEN + 2 * time] = _bounded(numbers[start])
        row[WALL_EVEN + 2 * time + 1] = np.float32(2.0) * sin * cos
    _fill_nearness(row, WALL_EVEN - 2, row[2])


@njit
def _fill_room(numbers: Float32Array, room: IntArray, goal: IntArray, row: Float32Array, counts: IntArray) -> None:
    for time in range(NUM_SLOTS):
        row[3 * time] = _bounded(numbers[goal[time] + 1])
        row[3 * time + 1] = _bounded(numbers[goal[time] + _GOAL_DISTANCE])
        row[3 * time + 2] = _bounded(numbers[room[time]])
        row[ROOM_EVEN + 2 * time] = _bounded(numbers[goal[time]])
        row[ROOM_EVEN + 2 * time + 1] = _bounded(numbers[room[time] + 1])
    last = 3 * NUM_SLOTS
    people, objects, walls = counts[PEOPLE], counts[OBJECTS], counts[WALLS]
    row[last], row[last + 1] = people / 15.0, people * people / 225.0
    row[last + 2], row[last + 3], row[last + 4] = walls / 50.0, objects / 10.0, counts[PAIRS] / 5.0
    row[last + 5] = 10.0 / (people + objects + walls + 2)
    _fill_nearness(row, last + 6, row[1])


@njit
def _fill_links(words: Int32Array, start: int, row_of: IntArray, rows: Rows, firsts: IntArray) -> None:
    """Fill the rows of pairs, and what people's rows say about links."""
    numbers, at, pair = words.view(np.float32), offsets(words, start), firsts[PAIRS]
    for link in range(words[start + 1]):
        relation = words[at.link_relations + link]
        first = row_of[words[at.link_sources + link]]
        if relation == 6:  # from a person to a wall, in metres
            row = rows.people[first]
            length = numbers[at.link_lengths + link] / np.float32(10.0)
            row[PERSON_EVEN - 5] = min(row[PERSON_EVEN - 5], length)
            row[PERSON_EVEN - 4] += np.float32(0.1)
        elif _is_pair(relation):
            second = row_of[words[at.link_targets + link]]
            rows.people[first, PERSON_EVEN - 3] = 1.0
            if relation == 4:
                rows.people[second, PERSON_EVEN - 3] = 1.0
                _fill_pair(rows.people[first], rows.people[second], PERSON_EVEN, rows.pairs[pair], np.float32(0.0))
            else:
                _fill_pair(rows.people[first], rows.objects[second], OBJECT_EVEN, rows.pairs[pair], np.float32(1.0))
            pair += 1


@njit
def _fill_pair(
    person: Float32Array, other: Float32Array, other_odd: int, row: Float32Array, is_object: np.float32
) -> None:
    """Fill a pair's row: both poses and velocities, and where the robot is from the line between the two."""
    for time in range(NUM_SLOTS):
        ax, ay = person[PERSON_EVEN + 4 * time], person[4 * time]
        bx, by = other[other_odd + 4 * time], other[4 * time]
        dx, dy = bx - ax, by - ay
        square = max(dx * dx + dy * dy, _LEAST_SQUARE)
        share = min(max(-(ax * dx + ay * dy) / square, np.float32(0.0)), np.float32(1.0))
        nx, ny = ax + share * dx, ay + share * dy
        even, odd = 8 * time, PAIR_EVEN + 4 * time
        row[even], row[even + 1] = ay, by
        row[even + 2], row[even + 3] = np.sqrt(nx * nx + ny * ny), share * (np.float32(1.0) - share)
        row[even + 4], row[even + 5] = person[4 * time + 3], other[4 * time + 3]
        row[even + 6], row[even + 7] = person[4 * time + 1], other[4 * time + 1]
        row[odd], row[odd + 1] = ax, bx
        row[odd + 2], row[odd + 3] = person[PERSON_EVEN + 4 * time + 2], other[other_odd + 4 * time + 2]
        if time == 0:
            row[PAIR_EVEN - 6], row[PAIR_EVEN - 5] = np.sqrt(square), is_object
    row[PAIR_EVEN - 4], row[PAIR_EVEN - 3] = person[2], other[2]
    _fill_nearness(row, PAIR_EVEN - 2, row[2])
    row[PAIR_EVEN + PAIR_ODD - 2], row[PAIR_EVEN + PAIR_ODD - 1] = person[PERSON_EVEN + 3], other[other_odd + 3]
