import json

import numpy as np
import pytest

from reward_model.analysis.synthetic_scenes import Person, SyntheticScene
from reward_model.commands.main import main
from reward_model.data.files import find_files, read_files
from reward_model.data.labelling import image_scores, label_windows
from reward_model.scenes.scene import ScenarioError
from reward_model.scenes.socnav2_json import read_socnav2
from reward_model.scorer import load_scorer
from tests.reward_model.example_scenes import hand_made_document
from tests.reward_model.random_scenes import random_windows
from tests.reward_model.scenes.test_socnav1 import RATING


@pytest.fixture
def folder(tmp_path):
    """Three scenes that are no more alike than their file names."""
    from reward_model.scenes.socnav2_json import write_socnav2

    (tmp_path / "scenes").mkdir()
    for number in range(3):
        scene = SyntheticScene((2.0, 1.0), people=[Person(1.0 + number, -1.0)])
        write_socnav2(scene.sequence(f"scene {number}"), tmp_path / "scenes" / f"{number}.json")
    return tmp_path / "scenes"


def label(capsys, *arguments):
    status = main(["label", "--data", *map(str, arguments)])
    return status, capsys.readouterr().err


def test_copies_carry_the_networks_scores(folder, tmp_path, capsys):
    (folder / "manifest.json").write_text("{}")
    output = tmp_path / "labelled"
    assert label(capsys, folder, "--output", output, "--weights", "default") == (0, "")
    files = find_files(output)["all"]
    assert [path.name for path in files] == ["0.json", "1.json", "2.json"]
    expected = load_scorer("default").score_batch([read_socnav2(path) for path in sorted(folder.glob("[0-9].json"))])
    found = [(each.q1, each.q2) for each in read_files(files)]
    assert found == [pytest.approx(row, abs=1e-6) for row in expected.clip(0, 1).tolist()]
    assert len({q1 for q1, _ in found}) == 3
    assert len(read_socnav2(files[0])) == len(read_socnav2(folder / "0.json"))


def test_a_second_run_does_what_is_missing(folder, tmp_path, capsys):
    output = tmp_path / "labelled"
    label(capsys, folder, "--output", output, "--weights", "default")
    before = {path: path.stat().st_mtime_ns for path in output.iterdir()}
    (output / "1.json").unlink()
    assert label(capsys, folder, "--output", output, "--weights", "default") == (0, "")
    assert {path.name for path in output.iterdir() if path.stat().st_mtime_ns != before[path]} == {"1.json"}


def test_what_cannot_be_labelled_is_one_line(folder, tmp_path, capsys):
    arguments = ("--output", tmp_path / "labelled", "--weights", "default")
    (tmp_path / "ratings.jsonl").write_text(json.dumps(RATING))
    status, error = label(capsys, tmp_path / "ratings.jsonl", *arguments)
    assert (status, error) == (
        2,
        f"reward_model: {tmp_path / 'ratings.jsonl'}: only recordings (*.json) can be labelled\n",
    )
    status, error = label(capsys, folder, "--output", folder, "--weights", "default")
    assert status == 2 and "labelled copies need a folder of their own" in error
    assert label(capsys, folder, *arguments, "--jobs", 0) == (2, "reward_model: jobs must be at least 1, got 0\n")
    document = hand_made_document()
    del document[0]["goal"]
    (folder / "9.json").write_text(json.dumps(document))
    status, error = label(capsys, folder, *arguments)
    assert (status, error.count("\n"), str(folder / "9.json") in error) == (2, 1, True)
    assert not (tmp_path / "labelled").exists()
    with pytest.raises(ScenarioError):
        list(read_files(find_files(folder)["all"]))


class Counting:
    """Scores a window with the number of windows that came before it and its number of frames."""

    def __init__(self):
        self.seen = 0

    def score_windows(self, windows):
        numbers = range(self.seen, self.seen + len(windows))
        self.seen += len(windows)
        return np.array([[number, len(window)] for number, window in zip(numbers, windows, strict=True)], np.float32)


def test_windows_are_labelled_in_their_order():
    windows = random_windows(seed=0, count=5) * 50
    reported = []
    labelled = label_windows(Counting(), windows, reported.append)
    assert labelled.windows is windows
    assert labelled.scores.tolist() == [[number, len(window)] for number, window in enumerate(windows)]
    assert (labelled.scores.dtype, labelled.weights) == (np.float32, None)
    assert reported == [100, 100, 50]
    assert label_windows(Counting(), []).scores.shape == (0, 2)


def test_a_window_has_four_images():
    class Seen:
        """Scores by the signs of the goal's place and of the first wall's direction."""

        name = "seen"

        def score_windows(self, windows):
            rows = []
            for window in windows:
                frame = window[0].arrays
                goal, wall = (int(np.flatnonzero(frame.kinds == kind)[0]) for kind in (4, 3))
                rows.append((frame.features[goal, 38], frame.features[wall, 34] + 2 * frame.features[wall, 35]))
            return np.array(rows, dtype=np.float32)

    windows = random_windows(2, 3)
    found = image_scores(Seen(), windows)
    assert found.shape == (3, 4, 2)
    signs = np.sign(found / found[:, :1])
    np.testing.assert_array_equal(signs[:, :, 0], [[1, 1, -1, -1]] * 3)  # left and right
    np.testing.assert_array_equal(np.abs(found[:, :, 1]), np.abs(found[:, :1, 1]).repeat(4, axis=1))
    assert (signs[:, 0, 1] != signs[:, 1, 1]).any()
