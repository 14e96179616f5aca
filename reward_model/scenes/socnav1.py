"""SocNav1, people's scores of static scenes (Manso et al. 2020, CC-BY 4.0), as labelled sequences.

The files are JSON lines, one rating each, in centimetres and degrees on screen axes: yPos grows downwards,
the robot stands at the origin and faces up. Orientation o faces (sin o, -cos o) in (xPos, yPos).

People scored disturbance alone (Q1), in a still picture without a goal. A SocNav2 scene has a time, a goal and
sizes, so these are filled in:

time      three equal snapshots one second apart, nothing moves, no command
goal      at the robot: the only place that favours no direction. It brings the published network's Q1 closest
          to the people's scores of all places tried (dev.jsonl: MSE .041, the same mean; with the goal 1, 3,
          5 m ahead .047, .050, .054; 1 m behind .044) at the same rank correlation, .81 against .82 and .83
sizes     objects are 0.4 x 0.4 m
"""

from __future__ import annotations

import os
import re
from dataclasses import replace

import numpy as np

from reward_model.base.arrays import FloatArray
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

OBJECT_SIZE = 0.4  # m, both ways
TIMESTAMPS = (0.0, 1.0, 2.0)  # s, a window of three frames

_CENTIMETRES = 100.0  # in a metre
_BEST_SCORE = 100.0
_CLOSED_TRIANGLE = 4  # points
_LINK_ITEMS = 3  # id, id, relation


def read_socnav1(path: str | os.PathLike[str]) -> list[LabelledSequence]:
    """Read a file of ratings, in its order; every rating is a sequence of its own.

    `scene` is the number in a rating's identifier, the same for all ratings of one scene; `q2` is None.

    Raises:
        ScenarioError: With one line naming the file, the line, the field and the rule.
    """
    name = os.fspath(path)
    ratings = []
    for number, line in enumerate(read_text_file(path).splitlines(), start=1):
        if line.strip():
            ratings.append(_parse_line(line, f"{name}: line {number}"))
    if not ratings:
        raise ScenarioError(f"{name}: must hold at least one rating, one a line, got none")
    return ratings


def _parse_line(line: str, place: str) -> LabelledSequence:
    rating = JsonField(decode_json(line, lambda _: place), place)
    identifier = rating["identifier"]
    digits = re.search(r"\d+", identifier.text())
    if digits is None:
        raise identifier.refused("must contain the number of the scene")
    score = rating["score"].number()
    if not 0 <= score <= _BEST_SCORE:
        raise rating["score"].refused(f"must lie within 0..{_BEST_SCORE:g}")
    snapshot = _parse_snapshot(rating)
    snapshots = tuple(replace(snapshot, timestamp=timestamp) for timestamp in TIMESTAMPS)
    return LabelledSequence(
        sequence=SceneSequence(snapshots, name=identifier.text()),
        q1=score / _BEST_SCORE,
        scene=digits.group(),
        rater=rating["rater"].text(),
    )


def _parse_snapshot(rating: JsonField) -> Snapshot:
    people, objects = rating["humans"], rating["objects"]
    ids = EntityIds(people, objects)
    num_people, num_objects = len(ids.people), len(ids.objects)
    return Snapshot(
        timestamp=TIMESTAMPS[0],
        interval=DEFAULT_INTERVAL,
        command=np.zeros(3),
        goal=np.zeros(2),
        people=People(ids.people, _poses(people), np.zeros((num_people, 3))),
        objects=Objects(
            ids.objects, _poses(objects), np.zeros((num_objects, 3)), np.full((num_objects, 2), OBJECT_SIZE)
        ),
        walls=_parse_walls(rating["room"]),
        interactions=ids.interactions(_link_fields(link) for link in rating["links"].items()),
    )


def _poses(entities: JsonField) -> FloatArray:
    """Return poses x, y, heading, (num_entities, 3)."""
    columns = entities.table(("xPos", "yPos", "orientation"))
    return np.column_stack([_positions(columns[:, :2]), -np.radians(columns[:, 2])])


def _positions(screen: FloatArray) -> FloatArray:
    """Convert positions (num_points, 2) from xPos, yPos to forward, left [m]."""
    return -screen[:, ::-1] / _CENTIMETRES


def _parse_walls(room: JsonField) -> FloatArray:
    """Return the walls (num_walls, 4) of a closed polygon, clockwise seen from above as in SocNav2."""
    screen = np.array([point.numbers(2) for point in room.items()]).reshape(-1, 2)
    if len(screen) < _CLOSED_TRIANGLE or (screen[0] != screen[-1]).any():
        raise ScenarioError(f"{room.place}: room must be a closed polygon, its last point the first one again")
    corners = _positions(screen)
    x, y = corners.T
    if (x[:-1] * y[1:] - x[1:] * y[:-1]).sum() > 0:  # twice the area, positive where counter-clockwise
        corners = corners[::-1]
    return np.hstack([corners[:-1], corners[1:]])


def _link_fields(link: JsonField) -> tuple[JsonField, JsonField, JsonField]:
    items = link.items()
    if len(items) != _LINK_ITEMS:
        raise link.refused("must be [id, id, relation]")
    return items[0], items[1], items[2]
