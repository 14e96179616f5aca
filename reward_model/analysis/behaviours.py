"""Measurements, with verdicts, of the behaviours that Bachiller et al. 2021 report of a good reward model.

Every measurement was fixed before any network was evaluated. All scenes are synthetic, in a square room of 9 m. A
score is low below 0.4, which raters saw labelled "acceptable"; it is fine from 0.6 on, labelled "good"; it is about 0
below 0.1, nearer to "unacceptable" (0) than to "undesirable" (0.2). The robot drives at
0.21 m/s or turns at 0.19 rad/s, as in `heatmap.ACTIONS`; people walk at 0.62 m/s, the median of SocNav2. Robot and
people are discs of 0.25 m.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import pi
from typing import Final

import numpy as np

from reward_model.analysis.heatmap import ACTIONS, WindowScorer, score_positions
from reward_model.analysis.synthetic_scenes import Person, SyntheticScene, Thing
from reward_model.base.arrays import FloatArray
from reward_model.graph.windows import sequence_frames
from reward_model.scenes.scene import Scores

HEADER: Final = ("", "measured", "claim", "found", "verdict")

ACCEPTABLE: Final = 0.4
GOOD: Final = 0.6
ABOUT_ZERO: Final = 0.1
WALKING_SPEED: Final = 0.62  # m/s
RADIUS: Final = 0.25  # m, of the robot and of people
TOP_SPEED: Final = 3.5 / 9.4  # m/s, the fastest that was rated

_FORWARD = ACTIONS["forward"]
_LEFT, _RIGHT = ACTIONS["turn left"], ACTIONS["turn right"]
_GOAL = (3.5, 3.5)
_DIRECTIONS = (0.0, pi / 2, pi, -pi / 2)
_TABLE = (0.79, 0.78)  # m, width and depth of a table in SocNav2


@dataclass(frozen=True)
class Finding:
    """One statement about a network.

    Attributes:
        statement: the letter of the paper's statement, and a number
        claim: the expected relation of the values
        measure: the description of the values
        values: by name, in the order of the claim; NaN where there was nothing to measure
        holds: whether the claim is true of the values
    """

    statement: str
    claim: str
    measure: str
    values: Mapping[str, float]
    holds: bool

    def cells(self) -> tuple[str, str, str, str, str]:
        """Statement, measure, claim, values and verdict as text: a row of the table, see `HEADER`."""
        values = ", ".join(f"{name} {value:.2f}" for name, value in self.values.items())
        return self.statement, self.measure, self.claim, values, "pass" if self.holds else "FAIL"

    def document(self) -> dict[str, object]:
        """The finding for JSON, with None for values that are not finite."""
        values = {name: value if np.isfinite(value) else None for name, value in self.values.items()}
        return {
            "statement": self.statement,
            "claim": self.claim,
            "measure": self.measure,
            "values": values,
            "holds": self.holds,
        }


def crowding(scorer: WindowScorer) -> list[Finding]:
    """a: the discomfort area of each person shrinks with the number of people."""
    spots = [(x, y) for x in (-1, 1) for y in (0, 2.5, -2.5)] + [(x, y) for x in (-3, 3) for y in (0, 2.5, -2.5)]
    spots.sort(key=lambda spot: spot[1] != 0 or abs(spot[0]) != 1)  # the two in the middle come first
    values = {}
    for count in (2, 4, 8, 12):
        people = [Person(x, y) for x, y in spots[:count]]
        areas = [
            _low_area(scorer, SyntheticScene(_GOAL, people=people), person, radius=1.0, step=0.1)
            for person in people[:2]
        ]
        values[f"{count} people"] = sum(areas) / len(areas)
    shrinking = all(np.diff(list(values.values())) < 0)
    measure = "area [m2] with Q1 below 0.4 within 1 m of each of the same two people; robot and people stand"
    return [Finding("a", "the area shrinks as the room fills", measure, values, shrinking)]


def walking(scorer: WindowScorer) -> list[Finding]:
    """b: the low area is larger around a standing person; a walking person's is skewed along the motion, in front."""
    still, moving, along, across = [], [], [], []
    for heading in _DIRECTIONS:
        stander, walker = Person(0, 0, heading), Person(0, 0, heading, WALKING_SPEED)
        still.append(_low_area(scorer, SyntheticScene(_GOAL, people=[stander]), stander))
        scene = SyntheticScene(_GOAL, people=[walker])
        moving.append(_low_area(scorer, scene, walker))
        ahead, aside = _low_centre(scorer, scene, walker)
        along.append(ahead)
        across.append(aside)
    areas = {"still": float(np.mean(still)), "walking": float(np.mean(moving))}
    shifts = {"along": float(abs(np.mean(along))), "across": float(abs(np.mean(across)))}
    oncoming = Person(0, 0, pi, WALKING_SPEED)
    scene = SyntheticScene(_GOAL, command=_FORWARD, people=[oncoming])
    front = {"ahead": _low_centre(scorer, scene, oncoming)[0]}
    where = "Q1 below 0.4 within 1.5 m of a person"
    return [
        Finding(
            "b1",
            "still > walking",
            f"area [m2] with {where}, mean of 4 headings; robot stands",
            areas,
            areas["still"] > areas["walking"],
        ),
        Finding(
            "b2",
            "along > across",
            f"how far [m] the centre of the area with {where} who walks is off that person, along and across the "
            "motion, mean of 4 headings; robot stands",
            shifts,
            shifts["along"] > shifts["across"],
        ),
        Finding(
            "b3",
            "ahead > 0",
            f"how far [m] the centre of the area with {where} is ahead of that person; robot drives as if "
            "to meet them head-on",
            front,
            front["ahead"] > 0,
        ),
    ]


def interacting(scorer: WindowScorer) -> list[Finding]:
    """c: crossing between two people who interact scores less than between two others; along their line still less."""
    strangers = SyntheticScene(_GOAL, command=_FORWARD, people=[Person(0, 1.5, -pi / 2), Person(0, -1.5, pi / 2)])
    friends = replace(strangers, interactions=[(1, 2)])
    crossing = {
        "interacting": _mean_midway_q1(scorer, friends, (0.0, pi)),
        "not": _mean_midway_q1(scorer, strangers, (0.0, pi)),
    }
    along = {"along": _mean_midway_q1(scorer, friends, (pi / 2, -pi / 2)), "across": crossing["interacting"]}
    where = "mean Q1 of driving within 0.5 m of the middle between two who stand 3 m apart and face each other"
    return [
        Finding("c1", "interacting < not", f"{where}, across", crossing, crossing["interacting"] < crossing["not"]),
        Finding("c2", "along < across", f"{where} and interact", along, along["along"] < along["across"]),
    ]


def near(scorer: WindowScorer) -> list[Finding]:
    """d: scores are fine near an unused object, and not near a person."""
    gap = 0.3  # m, between surfaces
    table = SyntheticScene(_GOAL, objects=[Thing(0, 0, 0, *_TABLE)])
    person = SyntheticScene(_GOAL, people=[Person(0, 0)])
    by_table = [(_TABLE[0] / 2 + RADIUS + gap, 0), (0, _TABLE[1] / 2 + RADIUS + gap)]
    by_person = [(2 * RADIUS + gap, 0), (0, 2 * RADIUS + gap)]
    values = {
        name: float(
            score_positions(scorer, scene.sequence(), np.array(places + [(-x, -y) for x, y in places]))[:, 0].mean()
        )
        for name, scene, places in (("table", table, by_table), ("person", person, by_person))
    }
    measure = "mean Q1 at 4 places with 0.3 m between the robot and a table that nobody uses, or a person; all stand"
    return [
        Finding("d1", "table >= 0.6", measure, {"table": values["table"]}, values["table"] >= GOOD),
        Finding("d2", "person < 0.6", measure, {"person": values["person"]}, values["person"] < GOOD),
    ]


def progress(scorer: WindowScorer) -> list[Finding]:
    """e: Q2 drops when the robot moves away from the goal; with the goal behind, turning scores more than driving."""
    behind, ahead = empty_room(scorer, goal_ahead=False), empty_room(scorer, goal_ahead=True)
    away = {
        "away": behind["forward"].q2,
        "standing": behind["standing"].q2,
        "towards": ahead["forward"].q2,
    }
    turning = {
        "turning left": behind["turning left"].q2,
        "turning right": behind["turning right"].q2,
        "forward": behind["forward"].q2,
    }
    where = "Q2 in an empty room, the goal 3 m"
    return [
        Finding(
            "e1",
            "away < standing and < towards",
            f"{where} behind, or ahead for towards",
            away,
            away["away"] < min(away["standing"], away["towards"]),
        ),
        Finding(
            "e2",
            "turning, either way > forward",
            f"{where} behind",
            turning,
            turning["forward"] < min(turning["turning left"], turning["turning right"]),
        ),
    ]


def touching(scorer: WindowScorer) -> list[Finding]:
    """f: touching anything scores about 0."""
    person = SyntheticScene(_GOAL, command=_FORWARD, people=[Person(2 * RADIUS, 0, pi)])
    table = SyntheticScene(_GOAL, command=_FORWARD, objects=[Thing(_TABLE[0] / 2 + RADIUS, 0, 0, *_TABLE)])
    wall = SyntheticScene(_GOAL, command=_FORWARD, robot=(4.5 - RADIUS, 0, 0))
    findings = []
    for number, (name, scene) in enumerate((("a person", person), ("a table", table), ("a wall", wall)), start=1):
        scores = _score(scorer, scene)
        measure = f"Q1 and Q2 of driving into {name}, surfaces just touching"
        values = {"Q1": scores.q1, "Q2": scores.q2}
        findings.append(
            Finding(f"f{number}", "Q1 and Q2 < 0.1", measure, values, max(scores.q1, scores.q2) < ABOUT_ZERO)
        )
    return findings


Behaviour = Callable[[WindowScorer], list[Finding]]

BEHAVIOURS: Final[tuple[Behaviour, ...]] = (crowding, walking, interacting, near, progress, touching)


def empty_room(scorer: WindowScorer, goal_ahead: bool) -> dict[str, Scores]:
    """Scores in the middle of an empty room, the goal 3 m ahead or behind, by the robot's action."""
    commands = {
        "standing": ACTIONS["stop"],
        "forward": _FORWARD,
        "forward, top speed": (TOP_SPEED, 0.0),
        "turning left": _LEFT,
        "turning right": _RIGHT,
    }
    goal = (3.0, 0.0) if goal_ahead else (-3.0, 0.0)
    return {name: _score(scorer, SyntheticScene(goal, command=command)) for name, command in commands.items()}


def _score(scorer: WindowScorer, scene: SyntheticScene) -> Scores:
    q1, q2 = scorer.score_windows([sequence_frames(scene.sequence())])[0].tolist()
    return Scores(q1, q2)


def _low_places(scorer: WindowScorer, scene: SyntheticScene, person: Person, radius: float, step: float) -> FloatArray:
    """Positions (num_places, 2) [m] relative to a person at which a robot with heading 0 has a low Q1."""
    count = round(radius / step)
    line = step * np.arange(-count, count + 1)
    grid = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    disc: FloatArray = grid[np.hypot(*grid.T) <= radius]
    scores = score_positions(scorer, scene.sequence(), disc + np.array([person.x, person.y]))
    return disc[scores[:, 0] < ACCEPTABLE]


def _low_area(
    scorer: WindowScorer, scene: SyntheticScene, person: Person, radius: float = 1.5, step: float = 0.15
) -> float:
    """The area [m2] around a person in which the robot has a low Q1."""
    return len(_low_places(scorer, scene, person, radius, step)) * step**2


def _low_centre(scorer: WindowScorer, scene: SyntheticScene, person: Person) -> tuple[float, float]:
    """The centre of that area, ahead of the person and to their left [m]; NaN where there is none."""
    places = _low_places(scorer, scene, person, radius=1.5, step=0.15)
    if not len(places):
        return np.nan, np.nan
    x, y = places.mean(axis=0)
    cosine, sine = np.cos(person.heading), np.sin(person.heading)
    return float(cosine * x + sine * y), float(cosine * y - sine * x)


def _mean_midway_q1(scorer: WindowScorer, scene: SyntheticScene, headings: tuple[float, ...]) -> float:
    """Mean Q1 of driving through the origin with these headings, within 0.5 m of it."""
    track = np.column_stack([np.linspace(-0.5, 0.5, 5), np.zeros(5)])
    scenes = [replace(scene, robot=(0.0, 0.0, heading)) for heading in headings]
    return float(np.mean([score_positions(scorer, each.sequence(), track)[:, 0] for each in scenes]))
