import json

import numpy as np
import pytest

from reward_model.base.progress import progress_bars
from reward_model.data.labelled_windows import LabelledWindows
from reward_model.data.people import read_people
from reward_model.graph.star import Stars
from tests.reward_model.random_scenes import random_windows

ROOM = [[-300, -300], [300, -300], [300, 300], [-300, 300], [-300, -300]]


class Half:
    name = "half"

    def score_windows(self, windows):
        return np.full((len(windows), 2), 0.5, dtype=np.float32)


def rating(scene: int, rater: str, score: float) -> str:
    human = {"id": 1, "xPos": 50 + scene, "yPos": -150, "orientation": 0}
    row = {"identifier": f"{scene:05} A", "rater": rater, "score": score, "room": ROOM, "humans": [human]}
    return json.dumps(row | {"objects": [], "links": []})


@pytest.fixture
def people(tmp_path):
    (tmp_path / "train.jsonl").write_text("\n".join(rating(scene, "a", 10 * scene) for scene in range(1, 4)))
    development = [rating(11, "a", 40), rating(11, "b", 80), rating(12, "a", 50)]
    (tmp_path / "dev.jsonl").write_text("\n".join(development))
    with progress_bars() as progress:
        return read_people(tmp_path, progress)


def test_ratings_are_a_share_of_what_is_learned(people):
    stars = Stars.of_windows(random_windows(0, 12))
    taught = LabelledWindows(stars, np.full((12, 2), 0.75, dtype=np.float32))
    joined = people.joined(taught, 0.25, seed=1)
    assert len(joined) == 16  # four of the sixteen
    np.testing.assert_array_equal(joined.scores[:12], taught.scores)
    assert np.isnan(joined.scores[12:, 1]).all()
    assert sorted(np.unique(joined.scores[12:, 0]).tolist()) == pytest.approx([0.1, 0.2, 0.3])
    assert len(people.joined(taught, 0.0, seed=1)) == 12


def test_errors_are_those_of_the_development_part(people):
    assert people.report(Half()) == {
        "ratings": 3,
        "development_ratings": 3,
        "development_mse": pytest.approx((0.01 + 0.09 + 0.0) / 3),
        "development_spearman": pytest.approx(float("nan"), nan_ok=True),
        "human_mse": pytest.approx(0.16),
    }
