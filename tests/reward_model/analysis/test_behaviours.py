import numpy as np
import pytest

from reward_model.analysis.behaviours import (
    BEHAVIOURS,
    HEADER,
    Finding,
    crowding,
    empty_room,
    interacting,
    near,
    progress,
    touching,
    walking,
)
from reward_model.graph.features import NodeKind
from reward_model.graph.frame import FrameGraph
from reward_model.scorer import SocialScorer, load_scorer

X, Y, VX, VY = 8, 9, 11, 12  # a person's features: right and forward [dam], moved backwards [dam in 0.2 s]


class Bubbles:
    """Q1 is 0 within a radius [m] of any point that lies a time [s] ahead of a person, else 1."""

    def __init__(self, radius: float, radius_per_person: float = 0.0, lead: float = 0.0) -> None:
        self.radius, self.radius_per_person, self.lead = radius, radius_per_person, lead

    def score_windows(self, windows: list[list[FrameGraph]]) -> np.ndarray:
        return np.array([[self._q1(window[0]), 0.5] for window in windows], dtype=np.float32)

    def _q1(self, frame: FrameGraph) -> float:
        people = frame.arrays.features[frame.arrays.kinds == NodeKind.PERSON]
        places = 10 * (people[:, [X, Y]] - people[:, [VX, VY]] / 0.2 * self.lead)
        radius = self.radius + self.radius_per_person * len(people)
        return float((np.hypot(*places.T) > radius).all())


@pytest.fixture(scope="module")
def published(published_weights) -> SocialScorer:
    return load_scorer("published")


def by_statement(findings: list[Finding]) -> dict[str, Finding]:
    return {finding.statement: finding for finding in findings}


def test_crowding_measures_the_area_around_each():
    (finding,) = crowding(Bubbles(0.55))
    assert not finding.holds
    assert list(finding.values) == ["2 people", "4 people", "8 people", "12 people"]
    for area in finding.values.values():
        assert area == pytest.approx(0.97)  # 97 cells of 0.01 m2 have their centres within 0.55 m
    (finding,) = crowding(Bubbles(0.8, radius_per_person=-0.05))
    assert finding.holds
    assert not crowding(Bubbles(0.1, radius_per_person=0.05))[0].holds


def test_walking_measures_where_the_area_lies():
    findings = by_statement(walking(Bubbles(0.5, lead=0.5)))
    assert findings["b1"].values["still"] == pytest.approx(37 * 0.15**2)  # 37 cells within 0.5 m
    assert findings["b2"].values["along"] == pytest.approx(0.31, abs=0.05)
    assert findings["b2"].values["across"] == pytest.approx(0, abs=1e-6)
    assert findings["b2"].holds
    assert findings["b3"].values["ahead"] == pytest.approx(0.42, abs=0.05)  # the robot's 0.21 m/s come on top
    assert findings["b3"].holds
    assert not by_statement(walking(Bubbles(0.5, lead=-0.5)))["b3"].holds


def test_nothing_low_is_no_number_and_fails():
    findings = by_statement(walking(Bubbles(-1.0)))
    assert np.isnan(findings["b3"].values["ahead"])
    assert not any(finding.holds for finding in findings.values())
    assert findings["b3"].document()["values"] == {"ahead": None}


def test_near_measures_person_and_table_at_the_same_gap():
    findings = by_statement(near(Bubbles(0.81)))
    assert findings["d1"].values == {"table": 1.0}
    assert findings["d2"].values == {"person": 0.0}
    assert findings["d1"].holds
    assert findings["d2"].holds
    assert not by_statement(near(Bubbles(0.79)))["d2"].holds


def test_touching_a_person_is_at_half_a_metre():
    assert touching(Bubbles(0.51))[0].values == {"Q1": 0.0, "Q2": 0.5}
    assert touching(Bubbles(0.49))[0].values == {"Q1": 1.0, "Q2": 0.5}


def test_a_constant_network_shows_no_behaviour_but_that_objects_are_fine():
    findings = [finding for behaviour in BEHAVIOURS for finding in behaviour(Bubbles(-1.0))]
    assert [finding.statement for finding in findings if finding.holds] == ["d1"]
    assert len({finding.statement for finding in findings}) == len(findings) == 13


def test_a_row_of_the_table():
    finding = Finding("c1", "interacting < not", "mean Q1", {"interacting": 0.456, "not": 0.5}, True)
    assert finding.cells() == ("c1", "mean Q1", "interacting < not", "interacting 0.46, not 0.50", "pass")
    assert len(HEADER) == 5


def test_the_published_network_in_an_empty_room(published):
    """What was measured with the published code: the goal 3 m ahead, then behind."""
    ahead, behind = empty_room(published, goal_ahead=True), empty_room(published, goal_ahead=False)
    assert ahead["standing"].q2 == pytest.approx(0.71, abs=0.006)
    assert ahead["forward"].q2 == pytest.approx(0.93, abs=0.006)
    assert ahead["forward, top speed"].q2 == pytest.approx(0.97, abs=0.006)
    assert 0.085 < behind["forward"].q2 < 0.105
    assert 0.085 < behind["forward, top speed"].q2 < 0.105
    assert behind["standing"].q2 == pytest.approx(0.67, abs=0.006)
    assert behind["turning left"].q2 == pytest.approx(0.86, abs=0.006)
    assert behind["turning right"].q2 == pytest.approx(0.89, abs=0.006)


def test_the_published_network_minds_interactions_people_and_the_way_to_the_goal(published):
    findings = by_statement(
        [finding for behaviour in (interacting, near, progress, touching) for finding in behaviour(published)]
    )
    verdicts = {statement: finding.holds for statement, finding in findings.items()}
    assert verdicts == {
        "c1": True,
        "c2": True,
        "d1": True,
        "d2": True,
        "e1": True,
        "e2": True,
        "f1": True,
        "f2": False,  # Q1 does not mind driving into a table, nor
        "f3": False,  # into a wall, with the surfaces just touching
    }
