import math

import numpy as np
import pytest

from reward_model.analysis.evaluation import error_histogram, human_ceiling, question_errors, report
from reward_model.scenes.ratings import Ratings, read_ratings
from tests.reward_model.analysis.test_agreement import ratings

NAN = math.nan


def test_errors_by_hand():
    predictions = np.array([[0.5, 0.2], [0.5, 0.4], [1.0, 0.6]], dtype=np.float32)
    scores = np.array([[0.0, NAN], [0.5, NAN], [1.0, NAN]], dtype=np.float32)
    found = question_errors(predictions, scores)
    assert list(found) == ["q1"]
    assert found["q1"].count == 3
    assert found["q1"].mse == pytest.approx(0.25 / 3)
    assert found["q1"].mae == pytest.approx(0.5 / 3)
    assert found["q1"].spearman == pytest.approx(math.sqrt(3) / 2)  # ranks 1.5, 1.5, 3 against 1, 2, 3


@pytest.mark.parametrize("prediction", [0.5, 0.0])
def test_equal_predictions_have_no_rank_correlation(prediction):
    predictions = np.full((3, 2), prediction, dtype=np.float32)
    scores = np.array([[0.1, NAN], [0.5, NAN], [0.7, NAN]], dtype=np.float32)
    assert math.isnan(question_errors(predictions, scores)["q1"].spearman)
    assert report(predictions, scores, ratings(("1", "a", 0.1, NAN)))["q1"]["spearman"] is None


def test_the_papers_ceiling_by_hand():
    """One clip, scored twice by each of two raters: reference .5; MSE of a (.25 + .01) / 2, of b (.16 + 0) / 2."""
    table = ratings(("1", "a", 1.0, NAN), ("1", "b", 0.1, NAN), ("1", "a", 0.4, NAN), ("1", "b", 0.5, NAN))
    ceiling = human_ceiling(table, 0)
    assert ceiling.clips == 1
    assert ceiling.one_against_all == pytest.approx((0.13 + 0.08) / 2)
    assert ceiling.one_against_others == pytest.approx((0.25 + 0.16 + 0.01 + 0.0) / 4 * (4 / 3) ** 2)
    assert ceiling.pairs == pytest.approx((0.81 + 0.36 + 0.25 + 0.09 + 0.16 + 0.01) / 6)


def test_every_rater_weighs_the_same_in_the_papers_ceiling():
    table = ratings(
        *(("1", "a", 0.0, NAN), ("1", "b", 1.0, NAN)),
        *(("2", "a", 0.0, NAN), ("2", "c", 0.2, NAN)),
        ("3", "c", 0.9, NAN),
    )
    assert human_ceiling(table, 0).one_against_all == pytest.approx(((0.25 + 0.01) / 2 + 0.25 + 0.01) / 3)
    assert human_ceiling(table, 0).clips == 2


def test_nobody_to_compare_with():
    ceiling = human_ceiling(ratings(("1", "a", 1.0, NAN)), 0)
    assert ceiling.clips == 0 and math.isnan(ceiling.pairs) and math.isnan(ceiling.one_against_all)


def test_people_on_socnav1(shared_data):
    """0.0327 and 0.0285 with the held-out part, which is not here."""
    table = read_ratings(shared_data / "socnav1" / name for name in ("train.jsonl", "dev.jsonl"))
    ceiling = human_ceiling(table, 0)
    assert ceiling.pairs == pytest.approx(0.0327, abs=5e-4)
    assert ceiling.one_against_others == pytest.approx(0.0285, abs=5e-4)
    assert ceiling.clips == 2525


def test_the_report_holds_the_ceiling_where_there_is_one():
    predictions = np.full((2, 2), 0.5, dtype=np.float32)
    table = ratings(("1", "a", 0.0, 0.3), ("1", "b", 1.0, NAN))
    found = report(predictions, table.scores.astype(np.float32), table)
    assert found["q1"]["mse"] == 0.25
    assert found["q1"]["human_pairs"] == 1.0
    assert "human_pairs" not in found["q2"]
    assert found["q2"]["count"] == 1


def test_a_histogram_is_a_png():
    predictions, scores = np.random.default_rng(0).uniform(0, 1.3, (2, 50, 2)).astype(np.float32)
    image = error_histogram(predictions, scores, "q2")
    assert image.startswith(b"\x89PNG\r\n")


def test_an_empty_table_has_no_ceiling():
    assert human_ceiling(Ratings((), (), np.zeros((0, 2))), 1).clips == 0
