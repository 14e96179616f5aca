"""Windows inside the range of the scenes that people rated, and outside it by one fact each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

import numpy as np

from reward_model.analysis.synthetic_scenes import Person, SyntheticScene, Thing
from reward_model.base.arrays import FloatArray
from reward_model.graph.windows import sequence_frames
from reward_model.scorer import SocialScorer

_SIDES, _WIDE = (4.0, 18.0), (25.0, 60.0)  # m
_PEOPLE, _CROWD = (0, 28), (35, 80)
_NEAR, _FAR = 10.0, (30.0, 60.0)  # m from the robot to the goal; rooms of 20 m have goals up to 28 m away
_SPEEDS, _FAST = (0.0, 0.37), (1.2, 3.0)  # m/s
_MOST_OBJECTS = 8
_WALKING = 1.2  # m/s
_TURNING = 0.38  # rad/s
_MARGIN = 0.5  # m from the walls
_TOGETHER = 256  # windows at a time, so that memory stays small


@dataclass(frozen=True)
class Marks:
    """What a scorer's range says of windows of one kind.

    Attributes:
        windows: number of windows
        marked: number of those that it marks
        example: the reasons given for the first one that is marked, empty where none is
    """

    windows: int
    marked: int
    example: tuple[str, ...]


def inside(rng: np.random.Generator) -> SyntheticScene:
    """A scene like those that were rated."""
    side = rng.uniform(*_SIDES)
    reach = side / 2 - _MARGIN
    places = rng.uniform(-reach, reach, (int(rng.integers(_PEOPLE[0], _PEOPLE[1] + 1)), 2))
    things = rng.uniform(-reach, reach, (int(rng.integers(0, _MOST_OBJECTS + 1)), 2))
    robot = rng.uniform(-reach, reach, 2)
    return SyntheticScene(
        goal=_goal(robot, rng.uniform(-reach, reach, 2), rng),
        side=side,
        robot=(*robot.tolist(), rng.uniform(-np.pi, np.pi)),
        command=(rng.uniform(*_SPEEDS), rng.uniform(-_TURNING, _TURNING)),
        people=_people(rng, places),
        objects=[Thing(x, y, rng.uniform(-np.pi, np.pi), *rng.uniform(0.2, 1.0, 2)) for x, y in things.tolist()],
    )


def in_a_wide_room(rng: np.random.Generator) -> SyntheticScene:
    """The same in a room of 25 to 60 m."""
    return replace(inside(rng), side=rng.uniform(*_WIDE))


def in_a_crowd(rng: np.random.Generator) -> SyntheticScene:
    """The same among 35 to 80 people."""
    scene = inside(rng)
    reach = scene.side / 2 - _MARGIN
    places = rng.uniform(-reach, reach, (int(rng.integers(_CROWD[0], _CROWD[1] + 1)), 2))
    return replace(scene, people=_people(rng, places))


def far_from_the_goal(rng: np.random.Generator) -> SyntheticScene:
    """The same with the goal 30 to 60 m away."""
    scene, distance, angle = inside(rng), rng.uniform(*_FAR), rng.uniform(-np.pi, np.pi)
    x, y, _ = scene.robot
    return replace(scene, goal=(x + distance * np.cos(angle), y + distance * np.sin(angle)))


def fast(rng: np.random.Generator) -> SyntheticScene:
    """The same with a robot of 1.2 to 3 m/s."""
    scene = inside(rng)
    return replace(scene, command=(rng.uniform(*_FAST), scene.command[1]))


CASES: Final = MappingProxyType[str, Callable[[np.random.Generator], SyntheticScene]](
    {
        "inside": inside,
        "room of 25 to 60 m": in_a_wide_room,
        "35 to 80 people": in_a_crowd,
        "goal 30 to 60 m away": far_from_the_goal,
        "robot of 1.2 to 3 m/s": fast,
    }
)
"""What each case is called and made by; the first is inside, the others are outside by one fact each."""


def marks(scorer: SocialScorer, scenes: int, seed: int) -> dict[str, Marks]:
    """The windows of each case that a scorer marks as out of its range.

    Raises:
        ValueError: If the scorer's weights have no range.
    """
    if scorer.training_range is None:
        raise ValueError(f"weights {scorer.name!r} have no range that scenes could be out of")
    found = {}
    for case, make in CASES.items():
        rng = np.random.default_rng([seed, list(CASES).index(case)])
        reasons: list[tuple[str, ...]] = []
        while len(reasons) < scenes:
            count = min(_TOGETHER, scenes - len(reasons))
            reasons += scorer.out_of_range([sequence_frames(make(rng).sequence()) for _ in range(count)])
        marked = [each for each in reasons if each]
        found[case] = Marks(len(reasons), len(marked), marked[0] if marked else ())
    return found


def _people(rng: np.random.Generator, places: FloatArray) -> list[Person]:
    """People at places (num_people, 2), who stand or walk."""
    return [
        Person(x, y, rng.uniform(-np.pi, np.pi), rng.uniform(0, _WALKING) if rng.random() < 0.5 else 0.0)
        for x, y in places.tolist()
    ]


def _goal(robot: FloatArray, point: FloatArray, rng: np.random.Generator) -> tuple[float, float]:
    """The point, drawn nearer to the robot where it is more than 10 m away."""
    distance = float(np.hypot(*(point - robot)))
    if distance > _NEAR:
        point = robot + (point - robot) * rng.uniform(0, _NEAR) / distance
    return float(point[0]), float(point[1])
