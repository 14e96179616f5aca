import math

import numpy as np
import pytest

from reward_model.scenes.ratings import ratings_of, read_ratings
from reward_model.scenes.scene import LabelledSequence, ScenarioError
from tests.reward_model.random_scenes import random_sequence


def test_a_table_is_read(tmp_path):
    path = tmp_path / "ratings.csv"
    path.write_text("rater,clip,q2,comment\nann,7,50,\nann,7,100,again\nbob,7,,\n")
    ratings = read_ratings([path])
    assert ratings.clips == ("7", "7", "7")
    assert ratings.raters == ("ann", "ann", "bob")
    np.testing.assert_array_equal(ratings.scores, [[np.nan, 0.5], [np.nan, 1.0], [np.nan, np.nan]])
    assert ratings.of_question(1) == {"7": [("ann", 0.5), ("ann", 1.0)]}
    assert ratings.of_question(0) == {}


def test_labelled_sequences_carry_ratings():
    sequence = random_sequence(np.random.default_rng(0), 1)
    ratings = ratings_of([LabelledSequence(sequence, 0.25, None, "12", "ann")])
    assert (ratings.clips, ratings.raters) == (("sequence",), ("ann",))
    assert ratings.scores[0, 0] == 0.25 and math.isnan(ratings.scores[0, 1])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "the first line must name the columns clip, rater and q1, q2 or both"),
        ("clip,rater\n", "the first line must name the columns clip, rater and q1, q2 or both"),
        ("clip,rater,q1\n", "must hold at least one rating, got none"),
        ("clip,rater,q1\n1,a,5\n,a,5\n", "line 3: clip and rater must not be empty"),
        ("clip,rater,q1\n1,a,101\n", "line 2: q1 must be a number in 0..100 or empty, got '101'"),
        ("clip,rater,q1\n1,a,good\n", "line 2: q1 must be a number in 0..100 or empty, got 'good'"),
        ("clip,rater,q1\n1,a,nan\n", "line 2: q1 must be a number in 0..100 or empty, got 'nan'"),
        (
            "clip,rater,q1\n1,a," + "5" * 200_000,
            "must be a CSV table (field larger than field limit ",
        ),
        ("clip,rater,q1\n1\n", "line 2: clip and rater must not be empty"),
    ],
)
def test_a_mistake_is_named_with_its_line(tmp_path, content, message):
    path = tmp_path / "ratings.csv"
    path.write_text(content)
    with pytest.raises(ScenarioError) as caught:
        read_ratings([path])
    assert str(caught.value).startswith(f"{path}: {message}")
    assert "\n" not in str(caught.value)


def test_other_files_are_refused(tmp_path):
    with pytest.raises(ScenarioError, match=r"x\.txt: ratings must be a \.csv table or a SocNav1 \.jsonl file$"):
        read_ratings([tmp_path / "x.txt"])
