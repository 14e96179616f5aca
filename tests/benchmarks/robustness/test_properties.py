import numpy as np
import pytest

from benchmarks.robustness.properties import PROPERTIES, Survey, permuted, walls_reversed
from benchmarks.robustness.scenes import kind_of, odd_scene
from reward_model.analysis.synthetic_scenes import Person, SyntheticScene, Thing
from reward_model.scenes.scene import ScenarioError
from reward_model.scorer import load_scorer


class Answers:
    """A scorer whose scores (2,) are a function of the scene."""

    def __init__(self, answer):
        self._answer = answer

    def score_batch(self, sequences):
        return np.array([self._answer(sequence) for sequence in sequences], dtype=np.float32)


@pytest.fixture
def scene():
    person, table = Person(0.5, 0), Thing(-2.0, 0.5, 0.3, 0.8, 0.8)
    return SyntheticScene((2.0, 1.0), people=[person, Person(2.0, 2.0)], objects=[table]).sequence("scene")


def failed(scene, answer, kind="room"):
    survey = Survey(Answers(answer))
    survey.check(kind, [scene])
    return {name for (name, _), tally in survey.tallies.items() if tally.failed}


def test_scores_that_depend_on_nothing_have_all_properties(scene):
    survey = Survey(Answers(lambda _: (0.0, 0.05)))
    survey.check("room", [scene, scene])
    assert {name: survey.tallies[name, "room"].checked for name in PROPERTIES} == dict.fromkeys(PROPERTIES, 2)
    assert all(tally.failed == 0 for tally in survey.tallies.values())


@pytest.mark.parametrize(
    ("answer", "expected"),
    [
        (lambda _: (0.0, 0.06), {"contact"}),
        (lambda _: (-0.01, 0.0), {"bounded"}),
        (lambda _: (1.01, 0.0), {"bounded", "contact"}),
        (lambda _: (np.inf, 0.0), {"bounded", "contact", "mirrored", "walls reversed", "permuted", "batched"}),
        (lambda _: (0.0, np.nan), {"bounded", "contact", "mirrored", "walls reversed", "permuted", "batched"}),
        (lambda each: (0.04 if each.last.goal[1] > 0 else 0.03, 0.0), {"mirrored"}),
        (lambda each: (0.04 if each.last.walls[1, 0] > each.last.walls[1, 2] else 0.03, 0.0), {"walls reversed"}),
        (lambda each: (0.04 if each.last.people.ids[0] == 1 else 0.03, 0.0), {"permuted"}),
    ],
)
def test_each_property_fails_by_its_own_breach(scene, answer, expected, monkeypatch):
    # Swap the two people, and leave the walls, which are told from each other by their place.
    monkeypatch.setattr(np.random, "default_rng", lambda _: Swaps())
    assert failed(scene, answer) == expected


class Swaps:
    def permutation(self, count):
        return np.arange(count)[::-1] if count == 2 else np.arange(count)


def test_scores_that_depend_on_the_batch_are_found(scene):
    class Batched:
        def score_batch(self, sequences):
            return np.full((len(sequences), 2), 0.01 * len(sequences), dtype=np.float32)

    survey = Survey(Batched())
    survey.check("room", [scene, scene])
    assert {name for (name, _), tally in survey.tallies.items() if tally.failed} == {"batched"}
    assert survey.tallies["batched", "room"].worst == pytest.approx(0.01)


def test_refusals_are_counted_and_other_errors_are_failures(scene):
    def refuse(_):
        raise ScenarioError("walls must not change")

    def crash(_):
        raise MemoryError("too large")

    survey = Survey(Answers(refuse))
    survey.check("room", [scene])
    (tally,) = survey.tallies.values()
    assert (tally.checked, tally.refused, tally.failed) == (1, 1, 0)
    survey = Survey(Answers(crash))
    survey.check("room", [scene])
    assert set(survey.tallies) == {("scored", "room")}
    assert survey.tallies["scored", "room"].failed == 1
    assert survey.tallies["scored", "room"].problem == "MemoryError: too large"


def test_the_worst_scene_is_kept(scene):
    other = SyntheticScene((2.0, 1.0), people=[Person(0.4, 0)]).sequence("other")
    survey = Survey(Answers(lambda each: (0.9, 0.0) if each.name == "other" else (0.3, 0.0)))
    survey.check("room", [scene, other, scene])
    tally = survey.tallies["contact", "room"]
    assert (tally.checked, tally.failed, tally.scene) == (3, 3, other)
    assert tally.worst == pytest.approx(0.9)


def test_other_listings_are_of_the_same_scene(scene):
    other = permuted(walls_reversed(scene), np.random.default_rng(1))
    for first, second in zip(scene, other, strict=True):
        assert {frozenset([(a, b), (c, d)]) for a, b, c, d in first.walls.tolist()} == {
            frozenset([(a, b), (c, d)]) for a, b, c, d in second.walls.tolist()
        }
        order = np.argsort(second.people.ids)
        np.testing.assert_array_equal(second.people.poses[order], first.people.poses)
        np.testing.assert_array_equal(second.people.velocities[order], first.people.velocities)
        np.testing.assert_array_equal(second.objects.sizes, first.objects.sizes)


def test_the_default_weights_score_every_scene_and_ordinary_ones_in_any_order_and_batch():
    survey = Survey(load_scorer())
    scenes = [odd_scene(0, index) for index in range(100)]
    for kind in ("room", "contact", "extreme", "limits"):
        survey.check(kind, [scene for index, scene in enumerate(scenes) if kind_of(index) == kind])
    found = {key: tally.failed for key, tally in survey.tallies.items()}
    assert [found["scored", kind] for kind in ("room", "contact", "extreme", "limits")] == [0, 0, 0, 0]
    assert [survey.tallies["scored", kind].refused for kind in ("room", "contact", "extreme")] == [0, 0, 0]
    assert survey.tallies["scored", "limits"].refused < 10  # walls too long for any graph
    for kind in ("room", "contact", "extreme", "limits"):
        assert found["bounded", kind] == found.get(("contact", kind), 0) == found["mirrored", kind] == 0
    for kind in ("room", "contact"):
        assert found["permuted", kind] == found["walls reversed", kind] == found["batched", kind] == 0
