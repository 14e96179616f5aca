import math

import numpy as np
import pytest

from reward_model.analysis.agreement import agreement, weighted_kappa
from reward_model.scenes.ratings import Ratings, read_ratings


def ratings(*rows) -> Ratings:
    """Rows of clip, rater, Q1, Q2."""
    clips, raters, q1, q2 = zip(*rows, strict=True)
    return Ratings(clips, raters, np.column_stack([q1, q2]).astype(float))


def listed(table):
    """The two lists of scores that a contingency table counts."""
    pairs = [(row, column) for row, counts in enumerate(table) for column, n in enumerate(counts) for _ in range(n)]
    first, second = np.array(pairs, dtype=float).T
    return first, second


def test_equal_scores_agree_fully_and_opposite_ones_less_than_by_chance():
    scores = np.array([0.0, 0.5, 1.0])
    assert weighted_kappa(scores, scores) == 1.0
    # distances 1, 0, 1; by chance (0 + .5 + 1 + .5 + 0 + .5 + 1 + .5 + 0) / 9
    assert weighted_kappa(scores, scores[::-1]) == pytest.approx(1 - (2 / 3) / (4 / 9))


def test_independent_scores_agree_by_chance():
    assert weighted_kappa(*listed([[1, 2], [2, 4]])) == pytest.approx(0.0, abs=1e-12)


def test_two_categories_are_cohens_kappa():
    """Agreement .7, by chance .25 + .25: the kappa of 1960, (.7 - .5) / (1 - .5)."""
    assert weighted_kappa(*listed([[20, 5], [10, 15]])) == pytest.approx(0.4)


def test_three_categories_by_hand():
    """Weights |i - j| on [[10, 5, 0], [2, 8, 3], [0, 4, 8]]: 14 / 40 seen; rows 15, 13, 12, columns 12, 17, 11."""
    by_chance = (15 * 17 + 13 * 12 + 13 * 11 + 12 * 17 + 2 * (15 * 11 + 12 * 12)) / 40**2
    kappa = weighted_kappa(*listed([[10, 5, 0], [2, 8, 3], [0, 4, 8]]))
    assert kappa == pytest.approx(1 - 0.35 / by_chance)
    assert round(kappa, 4) == 0.593


def test_kappa_does_not_depend_on_scale_and_order():
    rng = np.random.default_rng(0)
    first, second = rng.integers(0, 101, (2, 60)).astype(float)
    assert weighted_kappa(first / 100, second / 100) == pytest.approx(weighted_kappa(first, second))
    order = rng.permutation(60)
    assert weighted_kappa(second[order], first[order]) == pytest.approx(weighted_kappa(first, second))


@pytest.mark.parametrize("scores", [[], [0.3, 0.3]])
def test_kappa_of_nothing_to_tell_apart(scores):
    assert math.isnan(weighted_kappa(np.array(scores), np.array(scores)))


def test_raters_are_compared_on_the_clips_they_share_and_with_themselves():
    table = ratings(
        ("1", "b", 0.0, math.nan),
        ("1", "a", 0.0, math.nan),
        ("1", "a", 0.5, math.nan),
        ("2", "a", 1.0, math.nan),
        ("2", "a", 1.0, math.nan),
        ("2", "b", 1.0, 0.5),
        ("3", "c", 0.2, 0.5),
    )
    found = agreement(table, 0)
    assert found.raters == ("a", "b", "c")
    assert found.counts.tolist() == [[2, 4, 0], [4, 0, 0], [0, 0, 0]]
    # a against a: (0, .5), (1, 1), by chance (.5 + 1 + .5 + 0) / 4
    assert found.kappa[0, 0] == pytest.approx(1 - 0.25 / 0.5)
    # a against b: (0, 0), (.5, 0), (1, 1), (1, 1), by chance 0, .5, 1, 1 against 0 and 1
    assert found.kappa[0, 1] == found.kappa[1, 0] == pytest.approx(1 - 0.125 / 0.5)
    assert np.isnan(found.kappa[2]).all() and np.isnan(found.kappa[1, 1])
    assert not agreement(table, 1).counts.any()


def test_people_agree_on_socnav1(shared_data):
    """Two who scored more than 2,000 pictures together; no one scored a picture twice."""
    found = agreement(read_ratings(shared_data / "socnav1" / name for name in ("train.jsonl", "dev.jsonl")), 0)
    g, i = found.raters.index("g"), found.raters.index("i")
    assert len(found.raters) == 12
    assert found.counts[g, i] == 2126
    assert 0.5 < found.kappa[g, i] < 0.9
    assert not found.counts.diagonal().any()
