"""Scenes far beyond sense that the reader still accepts.

In `extreme_scene` each fact (walls, places, speeds, headings, sizes, times, ...) is drawn from one of several kinds,
from ordinary to 10 km and a million metres a second. `limit_scene` also has numbers at the limits of floating point.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations, product

import numpy as np

from reward_model.base.arrays import FloatArray, IntArray
from reward_model.scenes.scene import Interactions, Objects, People, SceneSequence, Snapshot

_MOST_PAIRS = 600
_MOST_PEOPLE, _MOST_OBJECTS = 200, 40
_IDS_OF_PEOPLE = 1_000_000  # more than there are, even where all are new in every snapshot
_LARGE_ID = 2**61
# Denormals and the largest numbers of float32 and, almost, of float64, with a few between: files have velocities as
# displacements and commands in other units, which must not overflow.
LIMITS = np.array([5e-324, 1e-310, 1e-45, 1e-38, 1e6, 1e19, 1e30, 3.4e38, 3.5e38, 1e154, 1e200, 1e307])


def extreme_scene(rng: np.random.Generator) -> SceneSequence:
    """A scene with any number of odd facts."""
    times, intervals = _times(rng)
    people, objects = _count(rng, _MOST_PEOPLE), _count(rng, _MOST_OBJECTS)
    walls, sizes, goal = _walls(rng), _sizes(rng, objects), _goal(rng)
    same_place, comes_and_goes, new_ids = rng.random() < 0.5, rng.random() < 0.3, rng.random() < 0.1
    person_poses, object_poses = _poses(rng, people), _poses(rng, objects)
    first_id = int(rng.choice([1, 1, -_LARGE_ID, _LARGE_ID]))
    density = float(rng.choice([0.0, 0.0, 0.1, 1.0]))
    snapshots = []
    for index, (time, interval) in enumerate(zip(times.tolist(), intervals.tolist(), strict=True)):
        if not same_place:
            person_poses, object_poses = _poses(rng, people), _poses(rng, objects)
            walls = walls + np.tile(rng.normal(0, 0.1, 2), 2)
        first, second = _present(rng, people, comes_and_goes), _present(rng, objects, comes_and_goes)
        person_ids = first_id + first + (_MOST_PEOPLE * index if new_ids else 0)
        object_ids = first_id + _IDS_OF_PEOPLE + second
        snapshots.append(
            Snapshot(
                time,
                interval,
                _command(rng),
                goal,
                People(person_ids, person_poses[first], _velocities(rng, len(first))),
                Objects(object_ids, object_poses[second], _velocities(rng, len(second)), sizes[second]),
                walls,
                _interactions(rng, person_ids, object_ids, density),
            )
        )
    return SceneSequence(tuple(snapshots), "extreme")


def limit_scene(rng: np.random.Generator) -> SceneSequence:
    """An extreme scene with one to three of its facts at the limits of floating point."""
    scene = extreme_scene(rng)
    changes: list[Callable[[np.random.Generator, Snapshot], Snapshot]] = [
        _limit_places,
        _limit_motion,
        _limit_headings,
        _limit_objects,
        _limit_goal,
        _limit_command,
        _limit_walls,
    ]
    snapshots = list(scene.snapshots)
    for which in rng.choice(len(changes), int(rng.integers(1, 4)), replace=False):
        seed = int(rng.integers(2**32))  # the same numbers in every snapshot, so that walls stay
        snapshots = [changes[which](np.random.default_rng(seed), snapshot) for snapshot in snapshots]
    return SceneSequence(tuple(snapshots), "limits")


def _times(rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Timestamps and intervals [s] of one to forty snapshots."""
    count = int(rng.choice([1, 2, 3, 12, 40]))
    spacing = float(rng.choice([1e-6, 0.1, 0.2, 1.0, 1.0, 1e6]))
    start = float(rng.choice([0.0, -5.0, 1e6]))
    interval = 0.2 if rng.random() < 0.5 else 10 ** rng.uniform(-6, 3)
    return start + spacing * np.arange(count), np.full(count, interval)


def _count(rng: np.random.Generator, most: int) -> int:
    return int(rng.choice([0, 1, rng.integers(0, 15), rng.integers(0, most + 1)]))


def _poses(rng: np.random.Generator, count: int) -> FloatArray:
    """Poses (count, 3) of people or objects: around, at one place, on the robot, in a heap on it, or far away."""
    kind = rng.integers(6)
    heading = rng.uniform(-np.pi, np.pi, (count, 1))
    if rng.random() < 0.2:
        heading *= 10 ** rng.uniform(0, 9)
    around = rng.uniform(-8, 8, (count, 2))
    places = (
        around,
        np.tile(rng.uniform(-8, 8, 2), (count, 1)),
        np.zeros((count, 2)),
        rng.normal(0, 0.3, (count, 2)),
        around * 10 ** rng.uniform(0, 5, (count, 1)),
        around * 10 ** rng.uniform(0, 5),
    )[kind]
    return np.hstack([places, heading])


def _velocities(rng: np.random.Generator, count: int) -> FloatArray:
    """Velocities (count, 3): none, a walk's, or up to a million."""
    scale = float(rng.choice([0.0, 1.0, 1.0, 10 ** rng.uniform(0, 6)]))
    return rng.uniform(-scale, scale, (count, 3))


def _sizes(rng: np.random.Generator, count: int) -> FloatArray:
    """Sizes (count, 2) [m]: none, a table's, or up to a million."""
    if rng.random() < 0.5:
        return rng.uniform(0.1, 1.5, (count, 2))
    return rng.choice([0.0, 0.3, 3.0, 1e3, 1e6], (count, 2)) * rng.uniform(0.5, 1.0, (count, 2))


def _goal(rng: np.random.Generator) -> FloatArray:
    distance = float(rng.choice([0.0, rng.uniform(0, 10), 10 ** rng.uniform(1, 6)]))
    angle = rng.uniform(-np.pi, np.pi)
    return distance * np.array([np.cos(angle), np.sin(angle)])


def _command(rng: np.random.Generator) -> FloatArray:
    scale = float(rng.choice([0.0, 0.4, 0.4, 10 ** rng.uniform(0, 6)]))
    return rng.uniform(-scale, scale, 3)


def _walls(rng: np.random.Generator) -> FloatArray:
    """Walls (num_walls, 4) [m]: none, a room of up to 10 km, a few loose ones, many short ones, or points."""
    kind = rng.choice(["none", "room", "room", "huge room", "loose", "many", "points"])
    if kind == "none":
        return np.zeros((0, 4))
    if kind in ("room", "huge room"):
        side = rng.uniform(3, 20) if kind == "room" else 10 ** rng.triangular(1, 1, 4)
        corners = side * (np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) - rng.uniform(0, 1, 2))
        walls = np.hstack([corners[::-1], np.roll(corners[::-1], -1, axis=0)])
        return np.vstack([walls, walls[:1, [0, 1, 0, 1]]]) if rng.random() < 0.2 else walls
    count = int(rng.integers(200, 2000)) if kind == "many" else int(rng.integers(1, 30))
    begin = rng.uniform(-8, 8, (count, 2)) * 10 ** rng.uniform(0, 2)
    length = {"loose": 20.0, "many": 0.9, "points": 0.0}[str(kind)]
    return np.hstack([begin, begin + rng.uniform(-length, length, (count, 2))])


def _present(rng: np.random.Generator, count: int, comes_and_goes: bool) -> IntArray:
    """Indices of those who are in a snapshot, in any order where they come and go."""
    if not comes_and_goes:
        return np.arange(count)
    return rng.permutation(count)[: int(rng.integers(0, count + 1))]


def _interactions(rng: np.random.Generator, people: IntArray, objects: IntArray, density: float) -> Interactions:
    """A share of all pairs of people, and of people and objects."""
    pairs = [*combinations(people.tolist(), 2), *product(people.tolist(), objects.tolist())]
    count = min(round(density * len(pairs)), _MOST_PAIRS)
    chosen = [pairs[index] for index in rng.permutation(len(pairs))[:count]]
    relations = tuple(str(rng.choice(["two_static_person_talking", "human_laptop_interaction", "?"])) for _ in chosen)
    return Interactions(np.array(chosen, dtype=np.int64).reshape(-1, 2), relations)


def _limits(rng: np.random.Generator, values: FloatArray, share: float = 0.5) -> FloatArray:
    """The values, a share of them and at least one replaced by numbers of `LIMITS` with any sign."""
    chosen = rng.random(values.shape) < share
    if chosen.size:
        chosen.flat[rng.integers(chosen.size)] = True
    return np.where(chosen, rng.choice(LIMITS, values.shape) * rng.choice([-1.0, 1.0], values.shape), values)


def _limit_places(rng: np.random.Generator, snapshot: Snapshot) -> Snapshot:
    people, poses = snapshot.people, snapshot.people.poses
    return replace(snapshot, people=replace(people, poses=np.hstack([_limits(rng, poses[:, :2]), poses[:, 2:]])))


def _limit_motion(rng: np.random.Generator, snapshot: Snapshot) -> Snapshot:
    """Velocities or the interval; files have the product of both."""
    people, objects = snapshot.people, snapshot.objects
    if rng.random() < 0.3:
        return replace(snapshot, interval=float(rng.choice(LIMITS[LIMITS < 1e300])))
    return replace(
        snapshot,
        interval=0.2,
        people=replace(people, velocities=_limits(rng, people.velocities)),
        objects=replace(objects, velocities=_limits(rng, objects.velocities)),
    )


def _limit_headings(rng: np.random.Generator, snapshot: Snapshot) -> Snapshot:
    people, objects = snapshot.people.poses, snapshot.objects.poses
    return replace(
        snapshot,
        people=replace(snapshot.people, poses=np.hstack([people[:, :2], _limits(rng, people[:, 2:])])),
        objects=replace(snapshot.objects, poses=np.hstack([objects[:, :2], _limits(rng, objects[:, 2:])])),
    )


def _limit_objects(rng: np.random.Generator, snapshot: Snapshot) -> Snapshot:
    objects = snapshot.objects
    poses = np.hstack([_limits(rng, objects.poses[:, :2], 0.2), objects.poses[:, 2:]])
    return replace(snapshot, objects=replace(objects, poses=poses, sizes=np.abs(_limits(rng, objects.sizes))))


def _limit_goal(rng: np.random.Generator, snapshot: Snapshot) -> Snapshot:
    return replace(snapshot, goal=_limits(rng, snapshot.goal))


def _limit_command(rng: np.random.Generator, snapshot: Snapshot) -> Snapshot:
    return replace(snapshot, command=np.clip(_limits(rng, snapshot.command), -1e306, 1e306))


def _limit_walls(rng: np.random.Generator, snapshot: Snapshot) -> Snapshot:
    """Walls without length at any distance, or one more wall of any length, also too long for any graph."""
    walls = snapshot.walls
    if rng.random() < 0.5:
        return replace(snapshot, walls=_limits(rng, walls[:, :2])[:, [0, 1, 0, 1]])
    return replace(snapshot, walls=np.vstack([walls, _limits(rng, np.zeros((1, 4)))]))
