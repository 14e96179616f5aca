"""Walks of real pedestrians as scenes of a robot: whoever walks is the robot, and the others are people."""

from __future__ import annotations

from typing import Final

import numpy as np

from benchmarks.realism.crowd_replay import STEP
from reward_model.base.angles import wrap_angles
from reward_model.base.arrays import FloatArray
from reward_model.graph.features import FRAME_SPACING, NUM_FRAMES
from reward_model.graph.frame import FrameGraph
from reward_model.graph.windows import frame_graph, select_window, wall_segments
from reward_model.scenes.poses import seen_from
from reward_model.scenes.scene import Interactions, Objects, People, SceneSequence, Snapshot

EVERY: Final = 4  # steps of a path between two snapshots
PERIOD: Final = EVERY * STEP  # s
SPAN: Final = round((NUM_FRAMES - 1) * FRAME_SPACING / PERIOD)  # snapshots before the first that fills a window
HALF_ROOM: Final = 5.0  # m, half a side of the square room that is drawn around a walk
NO_OBJECTS: Final = Objects(np.zeros(0, dtype=np.int64), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 2)))
NO_INTERACTIONS: Final = Interactions(np.zeros((0, 2), dtype=np.int64), ())


def walk_scene(path: FloatArray, others: FloatArray, goal: FloatArray) -> SceneSequence:
    """A scene with a snapshot every 0.2 s of a walk. People outside the room are left out.

    Args:
        path: (num_steps, 2) [m] of the robot, every 0.05 s
        others: (num_people, num_steps, 2) [m], NaN while absent
        goal: (2,) [m]
    """
    robot, people = _poses(path[::EVERY]), _poses(others[:, ::EVERY])
    centre = path.mean(axis=0)
    corners = np.zeros((4, 3))
    corners[:, :2] = centre + HALF_ROOM * np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]])  # clockwise, as in recordings
    here = np.isfinite(people).all(axis=-1)  # with a heading: not in the first and the last row of a track
    inside = here & (np.abs(people[..., :2] - centre) < HALF_ROOM).all(axis=-1)
    snapshots = []
    for row in range(1, len(robot)):
        before, now = robot[row - 1], robot[row]
        ids = np.flatnonzero(inside[:, row] & inside[:, row - 1])
        seen = seen_from(now, people[ids, row])
        walls = seen_from(now, corners)[:, :2]
        driven = seen_from(before, now[None])[0]
        snapshots.append(
            Snapshot(
                timestamp=row * PERIOD,
                interval=PERIOD,
                command=np.array([np.hypot(*driven[:2]), 0.0, wrap_angles(driven[2:])[0]]) / PERIOD,
                goal=seen_from(now, np.array([[*goal, 0.0]]))[0, :2],
                people=People(ids + 1, seen, _rates(seen_from(before, people[ids, row - 1]), seen)),
                objects=NO_OBJECTS,
                walls=np.hstack([walls, np.roll(walls, -1, axis=0)]),
                interactions=NO_INTERACTIONS,
            )
        )
    return SceneSequence(tuple(snapshots), "walk")


def windows_of(scene: SceneSequence) -> list[list[FrameGraph]]:
    """The window of each snapshot of a walk but the first `SPAN`, which have too little before them in real time."""
    segments = wall_segments(scene.last.walls)
    frames, times = [frame_graph(each, segments) for each in scene], [each.timestamp for each in scene]
    return [[frames[index] for index in select_window(times[:end])] for end in range(SPAN + 1, len(times) + 1)]


def _poses(places: FloatArray) -> FloatArray:
    """Poses (..., n, 3) from places (..., n, 2), everyone looking where they walk."""
    ways = np.gradient(places, axis=-2)
    return np.concatenate([places, np.arctan2(ways[..., 1:], ways[..., :1])], axis=-1)


def _rates(before: FloatArray, now: FloatArray) -> FloatArray:
    """Velocities (n, 3) between two poses, turning the short way."""
    change = now - before
    change[:, 2] = wrap_angles(change[:, 2])
    return np.asarray(change / PERIOD)
