import numpy as np
import pytest

from reward_model.base.progress import progress_bars
from reward_model.networks.checkpoint import load_checkpoint
from reward_model.networks.registry import MPNNConfig
from reward_model.scenes.scene import ScenarioError
from reward_model.scenes.socnav2_json import write_socnav2
from reward_model.scorer import load_scorer, weights_path
from reward_model.training.distillation import compared, distil, model_card, recordings_to_compare, save_with_card
from reward_model.training.fit import TrainingConfig
from tests.reward_model.random_scenes import random_sequence, random_windows


class Constant:
    """Scores everything the same."""

    name = "constant"

    def score_windows(self, windows):
        return np.full((len(windows), 2), (0.25, 0.75), dtype=np.float32)

    def score_batch(self, sequences):
        return self.score_windows(sequences)


@pytest.fixture(scope="module")
def student():
    windows = {"train": random_windows(0, 6), "development": random_windows(1, 3), "test": random_windows(2, 2)}
    config = TrainingConfig(max_epochs=2, batch_size=4, learning_rate=1e-2)
    with progress_bars() as progress:
        return distil(Constant(), windows, MPNNConfig((42, 4, 2), "tabulated"), config, progress)


def test_the_card_of_the_weights_that_ship_is_theirs():
    folder = weights_path("default")
    assert model_card(load_checkpoint(folder)) == (folder / "README.md").read_text(encoding="utf-8")


def test_a_student_says_what_it_learned_from(student):
    assert list(student.about) == [
        "teacher",
        "windows",
        "training",
        "epochs",
        "best_epoch",
        "train_error",
        "development_error",
        "parameters",
        "test_error",
    ]
    assert student.about["teacher"] == "constant"
    assert student.about["windows"] == {"train": 6, "development": 3, "test": 2}
    assert student.about["epochs"] == 2
    assert 0 < student.about["development_error"] < 1


def test_the_comparison_with_the_teacher_is_the_mean_and_the_largest_difference(student, tmp_path):
    recordings = [random_sequence(np.random.default_rng(seed)) for seed in range(3)]
    checkpoint = compared(Constant(), student, recordings)
    assert "genuine_error" not in student.about
    save_with_card(tmp_path / "student", checkpoint)
    apart = np.abs(load_scorer(tmp_path / "student").score_batch(recordings) - [0.25, 0.75])
    expected = {"rows": 3, "q1_mae": apart[:, 0].mean(), "q2_mae": apart[:, 1].mean(), "worst": apart.max()}
    assert checkpoint.about["genuine_error"] == pytest.approx(expected)
    assert load_checkpoint(tmp_path / "student").about == checkpoint.about
    card = (tmp_path / "student" / "README.md").read_text()
    assert "An MPNN of 42-4-2 features" in card
    assert f"| 3 rows of genuine SocNav2 recordings, mean absolute error | {apart[:, 0].mean():.4f} " in card
    assert "genuine" not in model_card(student)


def test_recordings_are_compared_whole_and_without_their_last_snapshots(tmp_path):
    for name, num_frames in (("b", 6), ("a", 5), ("reference", 4)):
        write_socnav2(random_sequence(np.random.default_rng(0), num_frames), tmp_path / f"{name}.json")
    assert [len(row) for row in recordings_to_compare(tmp_path)] == [5, 6, 2, 3]
    with pytest.raises(ScenarioError, match=r"must hold SocNav2 recordings \(\*.json\), found none"):
        recordings_to_compare(tmp_path / "none")
