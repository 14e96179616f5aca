"""Scores of a scene with the robot elsewhere in its room, or with another action.

The robot is moved and keeps its heading; everything else stays where it is in the room. In every frame of the window
the robot's recorded path is shifted by the same vector of the room, and everything is transformed into the frame of
the shifted path. Relative velocities are displacements over a snapshot's interval in the robot's frame, so they change
as well where the robot turns.

An action replaces the robot's path instead: the robot is taken to have driven with the action's constant forward speed
and turn rate for the whole window, on the arc that ends now at the position and heading in question. Older frames are
transformed into its frame on that arc, each frame's command is the action, and relative velocities are those of the
recorded motion over the ground, relative to that arc.

Both need the robot's own recorded motion. It is estimated from the walls, which stand still: a rotation and a shift
map one snapshot's walls to another's. Over a snapshot's interval it is the motion since the snapshot before, in
proportion where that one is not one interval older. A first snapshot has none before it: its command is taken as the
motion, unless nothing in it moves, as at the start of recordings.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from reward_model.base.arrays import Float32Array, FloatArray, IntArray
from reward_model.graph.frame import FrameGraph
from reward_model.graph.windows import frame_graph, select_window, wall_segments
from reward_model.scenes.poses import aligned, driven, placed_at, rotated, seen_from
from reward_model.scenes.scene import (
    Objects,
    People,
    ScenarioError,
    SceneSequence,
    Snapshot,
)

DEFAULT_RESOLUTION: Final = 81
_CHUNK: Final = 256  # positions scored at a time
_GAP: Final = 0.1  # m, between the ends of two walls that meet


class Action(NamedTuple):
    """A constant command of the robot: forward speed [m/s] and turn rate [rad/s]."""

    forward: float
    turn: float


_FORWARD = 2 / 9.4  # m/s, two simulator units, as the authors drive in their recording of a forward action
_TURN = 2 / 10.32  # rad/s, likewise two units

ACTIONS: Final = {
    "turn left": Action(0.0, _TURN),
    "stop": Action(0.0, 0.0),
    "turn right": Action(0.0, -_TURN),
    "forward-left": Action(_FORWARD, _TURN),
    "forward": Action(_FORWARD, 0.0),
    "forward-right": Action(_FORWARD, -_TURN),
}


class WindowScorer(Protocol):
    """A scorer of windows of frames, newest first, such as `SocialScorer`."""

    def score_windows(self, windows: list[list[FrameGraph]]) -> Float32Array:
        """Q1 and Q2 of windows, (num_windows, 2)."""
        ...


@dataclass(frozen=True, eq=False)
class Heatmap:
    """Scores of a robot at the centres of the cells of a grid over its room, in the recorded robot's frame.

    Attributes:
        x: (num_x,) [m] forward
        y: (num_y,) [m] to the left
        scores: (num_x, num_y, 2) Q1 and Q2, outside the room too
        inside: (num_x, num_y) whether the position is within the walls
    """

    x: FloatArray
    y: FloatArray
    scores: Float32Array
    inside: NDArray[np.bool_]


class _Frame(NamedTuple):
    """A snapshot of the window, and the robot's headings [rad] at it and one interval before, in the newest frame."""

    snapshot: Snapshot
    heading: float
    heading_before: float


def heatmap(
    scorer: WindowScorer,
    sequence: SceneSequence,
    action: Action | None = None,
    resolution: int = DEFAULT_RESOLUTION,
    report: Callable[[int], object] = lambda count: None,
) -> Heatmap:
    """Score a scene with the robot at the centre of every cell of a grid over the room's bounding box.

    Args:
        resolution: cells along each side
        action: replaces the robot's recorded motion
        report: called with the number of positions scored since its last call

    Raises:
        ScenarioError: If the walls enclose no room or a score is not finite.
        ValueError: For a resolution below 1.
    """
    if resolution < 1:
        raise ValueError(f"resolution must be at least 1, got {resolution}")
    walls = _enclosing_walls(sequence)
    low, high = walls.reshape(-1, 2).min(axis=0), walls.reshape(-1, 2).max(axis=0)
    shares = (np.arange(resolution)[:, None] + 0.5) / resolution
    x, y = (low + shares * (high - low)).T
    positions = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    scores = score_positions(scorer, sequence, positions.reshape(-1, 2), action, report)
    if not np.isfinite(scores).all():
        raise ScenarioError(f"{sequence.name}: every score must be finite; are the scene's lengths in metres?")
    return Heatmap(x, y, scores.reshape(resolution, resolution, 2), is_inside(walls, positions))


def score_positions(
    scorer: WindowScorer,
    sequence: SceneSequence,
    positions: FloatArray,
    action: Action | None = None,
    report: Callable[[int], object] = lambda count: None,
) -> Float32Array:
    """Q1 and Q2 (num_positions, 2) of a scene with the robot at other positions; see the module.

    Args:
        positions: (num_positions, 2) [m] in the recorded robot's frame
        action, report: as in `heatmap`
    """
    segments = wall_segments(sequence.last.walls)
    frames = _window(sequence, action)
    parts = [np.zeros((0, 2), dtype=np.float32)]
    for start in range(0, len(positions), _CHUNK):
        windows = _placed_windows(frames, segments, positions[start : start + _CHUNK])
        parts.append(scorer.score_windows(windows))
        report(len(windows))
    return np.concatenate(parts)


def placed(sequence: SceneSequence, position: FloatArray, action: Action | None = None) -> SceneSequence:
    """The window of a scene with the robot at another position; see the module.

    Args:
        position: (2,) [m] in the recorded robot's frame
    """
    frames = _window(sequence, action)
    return SceneSequence(tuple(_shifted(frame, position[None])[0] for frame in reversed(frames)), sequence.name)


def is_inside(walls: FloatArray, points: FloatArray) -> NDArray[np.bool_]:
    """Whether points (..., 2) lie within walls (num_walls, 4) that enclose a room, in any order."""
    x, y = points[..., 0, None], points[..., 1, None]
    x1, y1, x2, y2 = walls.T
    spans = (y1 > y) != (y2 > y)
    rise = np.where(y1 == y2, 1.0, y2 - y1)  # a wall along the ray is not crossed
    crossings = spans & (x < x1 + (y - y1) / rise * (x2 - x1))
    odd: NDArray[np.bool_] = crossings.sum(axis=-1) % 2 == 1
    return odd


def _enclosing_walls(sequence: SceneSequence) -> FloatArray:
    walls = sequence.last.walls
    if len(walls) < 3:
        raise ScenarioError(f"{sequence.name}: a heatmap needs walls around a room, at least 3, got {len(walls)}")
    ends = walls.reshape(-1, 2)
    near = np.hypot(*(ends[:, None] - ends).transpose(2, 0, 1)) < _GAP
    for end, others in zip(ends.tolist(), near.sum(axis=1) - 1, strict=True):
        if others != 1:
            raise ScenarioError(
                f"{sequence.name}: a heatmap needs walls that enclose a room, but {others} others end within "
                f"{_GAP} m of the wall's end at x={end[0]:.2f}, y={end[1]:.2f}; it must be one"
            )
    return walls


def _window(sequence: SceneSequence, action: Action | None) -> list[_Frame]:
    chosen = select_window([snapshot.timestamp for snapshot in sequence])
    return [_frame(sequence, index, action) for index in chosen]


def _frame(sequence: SceneSequence, index: int, action: Action | None) -> _Frame:
    """One snapshot of the window with the robot at its recorded position, moving by the action."""
    snapshot = sequence.snapshots[index]
    recorded = _recorded_pose(snapshot, sequence.last, sequence.name)
    recorded_before = placed_at(recorded, _own_motion(sequence, index))
    if action is None:
        return _Frame(snapshot, recorded[2], recorded_before[2])
    age = sequence.last.timestamp - snapshot.timestamp
    now, before = driven(*action, -age), driven(*action, -age - snapshot.interval)

    def moving(poses: FloatArray, velocities: FloatArray) -> tuple[FloatArray, FloatArray]:
        seen = seen_from(now, placed_at(recorded, poses))
        seen_before = seen_from(before, placed_at(recorded_before, poses - velocities * snapshot.interval))
        return seen, (seen - seen_before) / snapshot.interval

    def standing(points: FloatArray) -> FloatArray:
        return rotated(rotated(points, recorded[2]) + recorded[:2] - now[:2], -now[2])

    poses, velocities = moving(snapshot.people.poses, snapshot.people.velocities)
    object_poses, object_velocities = moving(snapshot.objects.poses, snapshot.objects.velocities)
    seen = replace(
        snapshot,
        command=np.array([action.forward, 0.0, action.turn]),
        goal=standing(snapshot.goal),
        people=replace(snapshot.people, poses=poses, velocities=velocities),
        objects=replace(snapshot.objects, poses=object_poses, velocities=object_velocities),
        walls=standing(snapshot.walls.reshape(-1, 2)).reshape(-1, 4),
    )
    return _Frame(seen, now[2], before[2])


def _recorded_pose(snapshot: Snapshot, other: Snapshot, name: str) -> FloatArray:
    """The robot's pose (3,) at a snapshot, in its frame at another one, estimated from the walls."""
    if len(snapshot.walls) != len(other.walls):
        raise ScenarioError(
            f"{name}: a scene's walls must not change: {len(other.walls)} walls at {other.timestamp} s, "
            f"{len(snapshot.walls)} at {snapshot.timestamp} s"
        )
    if not len(snapshot.walls):
        raise ScenarioError(f"{name}: moving the robot needs walls that tell how it moved, got none")
    return aligned(snapshot.walls.reshape(-1, 2), other.walls.reshape(-1, 2))


def _own_motion(sequence: SceneSequence, index: int) -> FloatArray:
    """The robot's pose (3,) one interval before a snapshot, in its frame at the snapshot."""
    snapshot = sequence.snapshots[index]
    if index > 0:
        earlier = sequence.snapshots[index - 1]
        share = snapshot.interval / (snapshot.timestamp - earlier.timestamp)
        return _recorded_pose(earlier, snapshot, sequence.name) * share
    if not (snapshot.people.velocities.any() or snapshot.objects.velocities.any()):
        return np.zeros(3)
    return driven(snapshot.command[0], snapshot.command[2], -snapshot.interval)


def _placed_windows(frames: list[_Frame], segments: IntArray, positions: FloatArray) -> list[list[FrameGraph]]:
    columns = [[frame_graph(seen, segments) for seen in _shifted(frame, positions)] for frame in frames]
    return [list(window) for window in zip(*columns, strict=True)]


def _shifted(frame: _Frame, positions: FloatArray) -> list[Snapshot]:
    """A frame relative to paths that are shifted by positions (num_positions, 2) in the newest frame."""
    snapshot = frame.snapshot
    shifts = rotated(positions, -frame.heading)
    nothing = np.zeros((len(positions), 1))
    moved = np.hstack([shifts, nothing])[:, None]  # (num_positions, 1, 3)
    sped = np.hstack([shifts - rotated(positions, -frame.heading_before), nothing])[:, None] / snapshot.interval
    people, objects = snapshot.people, snapshot.objects
    columns = (
        snapshot.goal - shifts,
        people.poses - moved,
        people.velocities - sped,
        objects.poses - moved,
        objects.velocities - sped,
        snapshot.walls - np.hstack([shifts, shifts])[:, None],
    )
    return [
        Snapshot(
            snapshot.timestamp,
            snapshot.interval,
            snapshot.command,
            goal,
            People(people.ids, people_poses, people_velocities),
            Objects(objects.ids, object_poses, object_velocities, objects.sizes),
            walls,
            snapshot.interactions,
        )
        for goal, people_poses, people_velocities, object_poses, object_velocities, walls in zip(*columns, strict=True)
    ]
