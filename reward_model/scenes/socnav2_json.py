"""Reading and writing of the SocNav2 JSON format of recorded scenes; no other module knows its conventions.

A file is a list of snapshots, oldest first. This project has metres per second, x forward, y left and
counter-clockwise angles (REP-103); the format has other conventions:

positions    x to the right, y forward [m]
angles       `a` grows clockwise and is 0 towards the robot's right side: a = -(heading + pi/2)
vx, vy       previous minus current position between this stored snapshot and the one before it [m]
va           current minus previous `a` over the same interval [rad]
command      [adv, side, rot] in simulator units: adv forward and side to the right, 9.4 units are 1 m/s;
             rot clockwise, 10.32 units are 1 rad/s. No recording has a side command: its sign follows x.
robot_pose   in the room's frame, x east, y north, `a` clockwise with 0 facing north. Here the room's x axis
             is its north: (y, -x, -a), checked on recordings, whose walls stand still in the room that way.
label_Q1/2   0..100, here 0..1

Reader and writer are inverse to each other. The format stores displacements without their interval; the reader
takes it from the timestamps: the difference to the snapshot before, or `DEFAULT_INTERVAL` in the first. Where a
snapshot's interval differs (a scene that starts in the middle of a recording, a simulator whose control period is
not its interval), the writer adds a field `interval` [s], which other readers ignore. The reader ignores other
unknown fields.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence as Listing

import numpy as np

from reward_model.base.arrays import FloatArray, IntArray
from reward_model.base.files import replace_file
from reward_model.scenes.json_entities import EntityIds
from reward_model.scenes.json_fields import JsonField, decode_json, read_text_file
from reward_model.scenes.scene import (
    DEFAULT_INTERVAL,
    LabelledSequence,
    Objects,
    People,
    ScenarioError,
    SceneSequence,
    Snapshot,
)

TRANSLATION_UNITS = 9.4  # simulator units in 1 m/s, the factor of the format's authors
ROTATION_UNITS = 10.32  # simulator units in 1 rad/s, likewise
LABEL_SCALE = 100.0  # a perfect score in the files

_COMMAND_UNITS = np.array([TRANSLATION_UNITS, -TRANSLATION_UNITS, -ROTATION_UNITS])
_POSE_FIELDS = ("x", "y", "a")
_VELOCITY_FIELDS = ("vx", "vy", "va")
_SIZE_FIELDS = ("size_x", "size_y")
_WALL_FIELDS = ("x1", "y1", "x2", "y2")
_SAME_INTERVAL = 1e-9  # s, intervals that differ by less are equal

Document = list[dict[str, object]]


def read_socnav2(path: str | os.PathLike[str]) -> SceneSequence:
    """Read a recorded scene.

    Raises:
        ScenarioError: With one line naming the file, the snapshot, the field and the rule.
    """
    return parse_socnav2(_read_document(path), os.fspath(path))


def read_labelled_socnav2(path: str | os.PathLike[str]) -> LabelledSequence:
    """Read a recorded scene and its scores.

    The scores are those of the last snapshot or, where it has none, of the newest one that has. One of the two
    questions may be missing. `scene` is the recording's `ID`.

    Raises:
        ScenarioError: Like `read_socnav2`, and where no snapshot has a score.
    """
    return parse_labelled_socnav2(_read_document(path), os.fspath(path))


def write_socnav2(recording: SceneSequence | LabelledSequence, path: str | os.PathLike[str]) -> None:
    """Write a scene atomically, with its scores where it has some."""
    replace_file(path, encode_socnav2(recording))


def encode_socnav2(recording: SceneSequence | LabelledSequence) -> bytes:
    """The content of the file that `write_socnav2` writes."""
    lines = [json.dumps(snapshot, allow_nan=False) for snapshot in socnav2_document(recording)]
    return ("[" + ",\n".join(lines) + "]\n").encode()


def parse_socnav2(document: object, name: str) -> SceneSequence:
    """The scene in a decoded JSON document.

    Args:
        name: the document's name in error messages

    Raises:
        ScenarioError: Like `read_socnav2`.
    """
    fields = _snapshot_fields(document, name)
    identity = fields[0]["ID"].text()
    snapshots: list[Snapshot] = []
    for field in fields:
        if field["ID"].text() != identity:
            raise field["ID"].refused(f"must be {json.dumps(identity)} as in the first snapshot")
        snapshots.append(_parse_snapshot(field, snapshots[-1].timestamp if snapshots else None))
    try:
        return SceneSequence(tuple(snapshots), name=identity)
    except ScenarioError as error:  # numbers that overflow in SI units
        raise ScenarioError(f"{name}: {error}") from error


def parse_labelled_socnav2(document: object, name: str) -> LabelledSequence:
    """The scene and its scores in a decoded JSON document, see `read_labelled_socnav2`."""
    sequence = parse_socnav2(document, name)
    for field in reversed(_snapshot_fields(document, name)):
        q1, q2 = _parse_label(field, "label_Q1"), _parse_label(field, "label_Q2")
        if q1 is not None or q2 is not None:
            return LabelledSequence(sequence, q1, q2, scene=sequence.name)
    raise ScenarioError(f"{name}: no snapshot has a label_Q1 or label_Q2; the last one needs one")


def socnav2_document(recording: SceneSequence | LabelledSequence) -> Document:
    """The document of a scene, ready for JSON encoding, with its scores in the last snapshot."""
    sequence = recording.sequence if isinstance(recording, LabelledSequence) else recording
    document: Document = []
    earlier: Snapshot | None = None
    for snapshot in sequence:
        document.append({"ID": sequence.name, **_snapshot_document(snapshot, earlier)})
        earlier = snapshot
    if isinstance(recording, LabelledSequence):
        for key, score in (("label_Q1", recording.q1), ("label_Q2", recording.q2)):
            if score is not None:
                document[-1][key] = score * LABEL_SCALE
    return document


def _read_document(path: str | os.PathLike[str]) -> object:
    return decode_json(read_text_file(path), lambda line: f"{os.fspath(path)}: line {line}")


def _snapshot_fields(document: object, name: str) -> list[JsonField]:
    if not isinstance(document, list):
        raise JsonField(document, name).refused("must be a list of snapshots")
    if not document:
        raise ScenarioError(f"{name}: must be a list of at least one snapshot, got an empty one")
    return [JsonField(snapshot, f"{name}: snapshot {index}") for index, snapshot in enumerate(document)]


def _parse_snapshot(field: JsonField, earlier: float | None) -> Snapshot:
    """Return the snapshot in a field; `earlier` is the timestamp of the one before it [s]."""
    timestamp = field["timestamp"].number()
    if earlier is not None and timestamp <= earlier:
        raise field["timestamp"].refused(f"must be later than {earlier} of the snapshot before")
    interval = _read_interval(timestamp, earlier)
    if (own := field.get("interval")) is not None:
        interval = own.number()
        if interval <= 0:
            raise own.refused("must be positive")
    people, objects = field["people"], field["objects"]
    ids = EntityIds(people, objects)
    links = [(link["src"], link["dst"], link["relation"]) for link in field["interaction"].items()]
    pose = field.get("robot_pose")
    return Snapshot(
        timestamp=timestamp,
        interval=interval,
        command=field["command"].numbers(3) / _COMMAND_UNITS,
        goal=_positions_from_json(_parse_goal(field["goal"]))[0],
        people=People(ids.people, *_parse_motion(people, interval)),
        objects=Objects(ids.objects, *_parse_motion(objects, interval), _parse_sizes(objects)),
        walls=_positions_from_json(field["walls"].table(_WALL_FIELDS).reshape(-1, 2)).reshape(-1, 4),
        interactions=ids.interactions(links),
        robot_pose=None if pose is None else _parse_robot_pose(pose),
    )


def _read_interval(timestamp: float, earlier: float | None) -> float:
    return DEFAULT_INTERVAL if earlier is None else timestamp - earlier


def _parse_motion(entities: JsonField, interval: float) -> tuple[FloatArray, FloatArray]:
    """Return poses and velocities, (num_entities, 3) each."""
    poses = entities.table(_POSE_FIELDS)
    moved = entities.table(_VELOCITY_FIELDS)
    headings = -poses[:, 2:] - math.pi / 2
    with np.errstate(over="ignore"):  # `SceneSequence` refuses numbers that are not finite
        velocities = np.column_stack([-moved[:, 1], moved[:, 0], -moved[:, 2]]) / interval
    return np.hstack([_positions_from_json(poses[:, :2]), headings]), velocities


def _parse_sizes(objects: JsonField) -> FloatArray:
    sizes = objects.table(_SIZE_FIELDS)
    for row, column in np.argwhere(sizes < 0)[:1].tolist():
        raise objects.items()[row][_SIZE_FIELDS[column]].refused("must not be negative")
    return sizes


def _parse_goal(goal: JsonField) -> FloatArray:
    """Return the position of the only goal, (1, 2)."""
    count = len(goal.items())
    if count != 1:
        raise ScenarioError(f"{goal.place}: goal must be a list of one point, got {count}")
    return goal.table(("x", "y"))


def _parse_robot_pose(pose: JsonField) -> FloatArray:
    x, y, a = (pose[key].number() for key in _POSE_FIELDS)
    return np.array([y, -x, -a])


def _parse_label(snapshot: JsonField, key: str) -> float | None:
    label = snapshot.get(key)
    if label is None:
        return None
    if not 0 <= label.number() <= LABEL_SCALE:
        raise label.refused(f"must lie within 0..{LABEL_SCALE:g}")
    return label.number() / LABEL_SCALE


def _snapshot_document(snapshot: Snapshot, earlier: Snapshot | None) -> dict[str, object]:
    people, objects, interactions = snapshot.people, snapshot.objects, snapshot.interactions
    people_rows = np.hstack(_motion_to_json(people.poses, people.velocities, snapshot.interval))
    object_rows = np.hstack([*_motion_to_json(objects.poses, objects.velocities, snapshot.interval), objects.sizes])
    walls = _positions_to_json(snapshot.walls.reshape(-1, 2)).reshape(-1, 4)
    document: dict[str, object] = {
        "command": (snapshot.command * _COMMAND_UNITS).tolist(),
        "goal": _named_rows(("x", "y"), _positions_to_json(snapshot.goal[None, :])),
        "interaction": [
            {"src": source, "dst": target, "relation": relation}
            for (source, target), relation in zip(interactions.pairs.tolist(), interactions.relations, strict=True)
        ],
        "objects": _entity_rows(objects.ids, (*_POSE_FIELDS, *_VELOCITY_FIELDS, *_SIZE_FIELDS), object_rows),
        "people": _entity_rows(people.ids, (*_POSE_FIELDS, *_VELOCITY_FIELDS), people_rows),
        "timestamp": float(snapshot.timestamp),
        "walls": _named_rows(_WALL_FIELDS, walls),
    }
    expected = _read_interval(snapshot.timestamp, None if earlier is None else earlier.timestamp)
    if abs(snapshot.interval - expected) > _SAME_INTERVAL:
        document["interval"] = float(snapshot.interval)
    if snapshot.robot_pose is not None:
        x, y, heading = snapshot.robot_pose.tolist()
        document["robot_pose"] = {"x": -y, "y": x, "a": -heading}
    return document


def _motion_to_json(poses: FloatArray, velocities: FloatArray, interval: float) -> tuple[FloatArray, FloatArray]:
    moved = np.column_stack([velocities[:, 1], -velocities[:, 0], -velocities[:, 2]]) * interval
    return np.hstack([_positions_to_json(poses[:, :2]), -(poses[:, 2:] + math.pi / 2)]), moved


def _named_rows(keys: Listing[str], rows: FloatArray) -> list[dict[str, float]]:
    return [dict(zip(keys, row, strict=True)) for row in rows.tolist()]


def _entity_rows(ids: IntArray, keys: Listing[str], rows: FloatArray) -> list[dict[str, float]]:
    named = _named_rows(keys, rows)
    return [{"id": identity, **row} for identity, row in zip(ids.tolist(), named, strict=True)]


def _positions_from_json(positions: FloatArray) -> FloatArray:
    """Convert positions (num_points, 2) from right, forward to forward, left."""
    return np.column_stack([positions[:, 1], -positions[:, 0]])


def _positions_to_json(positions: FloatArray) -> FloatArray:
    """Convert positions (num_points, 2) from forward, left to right, forward."""
    return np.column_stack([-positions[:, 1], positions[:, 0]])
