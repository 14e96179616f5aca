import numpy as np
import pytest

from benchmarks.robustness.rated_range import CASES, Marks, marks

WIDE, CROWD, FAR, FAST = list(CASES)[1:]


class Range:
    """Marks windows of more than 30 people, as the real ones do."""

    name = "ranged"

    training_range = "known"

    def out_of_range(self, windows):
        people = [int((window[0].arrays.kinds == 0).sum()) for window in windows]
        return [(f"{count} people",) if count > 30 else () for count in people]


def facts(scene):
    """Side, number of people, distance to the goal and speed."""
    x, y, _ = scene.robot
    distance = np.hypot(scene.goal[0] - x, scene.goal[1] - y)
    return np.array([scene.side, len(scene.people), distance, scene.command[0]])


@pytest.mark.parametrize(("case", "different"), [("inside", None), (WIDE, 0), (CROWD, 1), (FAR, 2), (FAST, 3)])
def test_scenes_are_outside_by_the_fact_that_names_them(case, different):
    least, most = np.array([4, 0, 0, 0.0]), np.array([18, 28, 10, 0.37])
    if different is not None:
        least[different] = (25, 35, 30, 1.2)[different]
        most[different] = (60, 80, 60, 3.0)[different]
    rng = np.random.default_rng(0)
    found = np.array([facts(CASES[case](rng)) for _ in range(50)])
    assert (found >= least).all()
    assert (found <= most).all()


def test_marks_are_counted_case_by_case():
    found = marks(Range(), 6, seed=0)
    assert {case: result.marked for case, result in found.items()} == {
        case: 6 if case == CROWD else 0 for case in CASES
    }
    assert found["inside"] == Marks(6, 0, ())
    assert found[CROWD].example[0].endswith(" people")


def test_weights_without_a_range_are_named():
    with pytest.raises(ValueError, match="weights 'old' have no range"):
        marks(type("Scorer", (), {"name": "old", "training_range": None})(), 1, seed=0)
