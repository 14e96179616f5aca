"""A small scene in the SocNav2 JSON format, written by hand."""

import copy
from typing import Any

FIRST: dict[str, Any] = {
    "ID": "made_by_hand",
    "timestamp": 10.0,
    "command": [0.0, 0.0, 0.0],
    "goal": [{"x": 1.0, "y": 3.0}],
    "people": [
        {"id": 1, "x": 1.0, "y": 2.0, "a": 0.0, "vx": 0.0, "vy": 0.0, "va": 0.0},
        {"id": 2, "x": -2.0, "y": 0.5, "a": -1.5, "vx": 0.0, "vy": 0.0, "va": 0.0},
    ],
    "objects": [
        {
            "id": 7,
            "x": 0.0,
            "y": -1.0,
            "a": 0.25,
            "vx": 0.0,
            "vy": 0.0,
            "va": 0.0,
            "size_x": 0.5,
            "size_y": 0.75,
        }
    ],
    "walls": [
        {"x1": 4.0, "y1": 5.0, "x2": 4.0, "y2": -5.0},
        {"x1": 4.0, "y1": -5.0, "x2": -4.0, "y2": -5.0},
    ],
    "interaction": [{"src": 2, "dst": 7, "relation": "human_plant_interaction"}],
    "robot_pose": {"x": 0.5, "y": 1.5, "a": 0.125},
}


def hand_made_document() -> list[dict[str, Any]]:
    """Two snapshots half a second apart; person 1 moved 0.1 m to the right, 0.2 m back and turned left."""
    first, second = copy.deepcopy(FIRST), copy.deepcopy(FIRST)
    second["timestamp"] = 10.5
    second["command"] = [1.88, 0.94, 2.064]
    second["people"][0] = {"id": 1, "x": 1.1, "y": 1.8, "a": -0.25, "vx": -0.1, "vy": 0.2, "va": -0.25}
    return [first, second]
