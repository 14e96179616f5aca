import numpy as np
import pytest

from reward_model.data.taught import TaughtWindows
from reward_model.graph.star import Stars
from reward_model.networks.checkpoint import load_checkpoint
from reward_model.scenes.scene import ScenarioError
from reward_model.scenes.socnav2_json import write_socnav2
from reward_model.scorer import SocialScorer, load_scorer, weights_path
from reward_model.training.distillation import (
    compared,
    differences,
    model_card,
    recordings_to_compare,
    save_with_card,
)
from reward_model.training.ensemble import united
from tests.reward_model.random_scenes import random_sequence, random_windows
from tests.reward_model.training.test_ensemble import trained


class Lopsided:
    """Scores by the side on which the goal is."""

    name = "lopsided"

    def score_windows(self, windows):
        left = [float(window[0].arrays.features[window[0].arrays.kinds == 4][0, 38] < 0) for window in windows]
        return np.array([(0.25 + 0.5 * side, 0.75) for side in left], dtype=np.float32)


@pytest.fixture(scope="module")
def student(tmp_path_factory):
    return united(trained(tmp_path_factory.mktemp("members")))


def test_the_card_of_the_weights_that_ship_is_theirs():
    folder = weights_path("default")
    assert model_card(load_checkpoint(folder)) == (folder / "README.md").read_text(encoding="utf-8")


def test_recordings_are_compared_with_the_mean_over_the_images(student):
    recordings = [random_sequence(np.random.default_rng(seed)) for seed in range(3)]
    found = compared(Lopsided(), student, recordings)
    apart = np.abs(SocialScorer(student, "student").score_batch(recordings) - [0.5, 0.75])
    expected = {"rows": 3, "q1_mae": apart[:, 0].mean(), "q2_mae": apart[:, 1].mean(), "worst": apart.max()}
    assert found == pytest.approx(expected)


def test_differences_are_told_apart_by_the_teachers_range(student):
    windows = random_windows(4, 9)
    for index, around in enumerate([(9, 9, 9, 8)] * 5 + [(9, 9, 9, 30)] * 3 + [(0.2, 9, 9, 8)]):
        windows[index] = [windows[index][0].replaced(surroundings=np.array(around, dtype=np.float32))]
    images = np.random.default_rng(0).uniform(0, 1, (9, 4, 2)).astype(np.float32)
    taught = TaughtWindows(Stars.of_windows(windows), images)
    found = differences(student, taught)
    scores = SocialScorer(student, "student").score_windows(windows)
    wrong = (scores - images.mean(axis=1)) ** 2
    assert [found[part]["windows"] for part in ("teacher_range", "beyond", "contact")] == [5, 3, 1]
    assert found["teacher_range"]["q1"]["mse"] == pytest.approx(wrong[:5, 0].mean(), abs=1e-6)
    assert found["beyond"]["q2"]["mse"] == pytest.approx(wrong[5:8, 1].mean(), abs=1e-6)
    single = ((images - images.mean(axis=1, keepdims=True)) ** 2)[:5, :, 0].mean()
    assert found["teacher_range"]["q1"]["teacher_single_mse"] == pytest.approx(single, abs=1e-6)
    assert -1 <= found["teacher_range"]["q1"]["spearman"] <= 1
    assert found["contact"]["largest"] <= 0.05


def test_the_card_says_what_is_known(student, tmp_path):
    from dataclasses import replace

    question = {"mse": 0.001, "teacher_single_mse": 0.002, "spearman": 0.5}
    errors = {"windows": 1000, "q1": question, "q2": {**question, "spearman": None}}
    about = {
        **student.about,
        "windows": {"train": 12345, "development": 10, "test": 1100},
        "test": {"teacher_range": errors, "beyond": {"windows": 0}},
    }
    plain = replace(student, about=about)
    card = model_card(plain)
    assert "An ensemble of 2 star networks (rounds of 6 features)" in card
    assert "| within the teacher's range | 1,000 | 0.00100 / 0.00100 | 0.00200 / 0.00200 | 0.50 / - |" in card
    assert "| beyond it | 0 | - | - | - |" in card
    assert "None of its scores are people's." in card
    people = {"share": 0.08, "ratings": 7, "development_ratings": 5, "development_mse": 0.02, "human_mse": 0.03}
    genuine = {"rows": 12, "q1_mae": 0.03, "q2_mae": 0.04, "worst": 0.1}
    save_with_card(tmp_path / "student", replace(plain, about={**about, "people": people, "genuine": genuine}))
    card = (tmp_path / "student" / "README.md").read_text()
    assert "SocNav1's 7 training ratings by people (Q1 alone) are\n8% of what it sees in an epoch." in card
    assert "On 12 rows of genuine SocNav2 recordings" in card
    assert load_scorer(tmp_path / "student").training_range is not None


def test_recordings_are_compared_whole_and_without_their_last_snapshots(tmp_path):
    for name, num_frames in (("b", 6), ("a", 5), ("reference", 4)):
        write_socnav2(random_sequence(np.random.default_rng(0), num_frames), tmp_path / f"{name}.json")
    assert [len(row) for row in recordings_to_compare(tmp_path)] == [5, 6, 2, 3]
    with pytest.raises(ScenarioError, match=r"must hold SocNav2 recordings \(\*.json\), found none"):
        recordings_to_compare(tmp_path / "none")
