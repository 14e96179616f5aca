import json
import resource
from contextlib import contextmanager

import pytest

from reward_model.commands.main import main
from reward_model.scorer import load_scorer
from tests.reward_model.data.test_files import recording
from tests.reward_model.scenes.test_socnav1 import RATING


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("SOCNAV_CACHE", str(tmp_path / "cache"))


@pytest.fixture
def recordings(tmp_path):
    """Six labelled recordings in three parts."""
    folder = tmp_path / "recordings"
    folder.mkdir()
    for number, name in enumerate("abcdef"):
        recording(folder / f"{name}.json", label_Q1=10 * number, label_Q2=90 - 10 * number)
    for name, members in (("train", "abcd"), ("dev", "e"), ("test", "f")):
        (folder / f"{name}_set.txt").write_text("\n".join(f"{member}.json" for member in members))
    return folder


def run(capsys, *arguments):
    status = main([*map(str, arguments)])
    output = capsys.readouterr()
    return status, output.out, output.err


@pytest.mark.parametrize("network", ["mpnn", "rgcn", "gat"])
def test_train_then_evaluate(recordings, tmp_path, capsys, network):
    if network != "mpnn":
        pytest.importorskip("dgl")
    output = tmp_path / "trained"
    arguments = (
        "--data",
        recordings,
        "--network",
        network,
        "--output",
        output,
        "--hidden-sizes",
        6,
        "--augment",
        "all",
    )
    status, out, _ = run(capsys, "train", *arguments, "--max-epochs", 2, "--device", "cpu")
    about = json.loads(out)
    assert status == 0
    assert about["examples"] == {"train": 16, "development": 1, "test": 1}
    assert about["questions"] == ["q1", "q2"]
    assert set(about["test_error"]) == {"q1", "q2"}
    assert (output / "curve.csv").read_text().splitlines()[0] == "epoch,train_error,development_error"
    assert len(list((output / "tensorboard").iterdir())) == 1
    assert load_scorer(output).name == str(output)
    status, out, _ = run(
        capsys, "evaluate", "--data", recordings, "--weights", output, "--part", "test", "--output", tmp_path / "report"
    )
    found = json.loads(out)
    assert (status, found["examples"], found["q1"]["count"]) == (0, 1, 1)
    assert found["q1"]["mse"] == pytest.approx(about["test_error"]["q1"], abs=1e-5)
    assert sorted(path.name for path in (tmp_path / "report").iterdir()) == [
        "absolute_errors_q1.png",
        "absolute_errors_q2.png",
        "evaluation.json",
    ]
    assert json.loads((tmp_path / "report" / "evaluation.json").read_text()) == found


def test_a_training_is_not_overwritten(recordings, tmp_path, capsys):
    arguments = ("train", "--data", recordings, "--output", tmp_path / "trained", "--hidden-sizes", 2)
    assert run(capsys, *arguments, "--max-epochs", 1)[0] == 0
    status, _, err = run(capsys, *arguments, "--max-epochs", 1)
    assert (status, err.splitlines()[-1]) == (
        2,
        f"reward_model: {tmp_path / 'trained'}: holds a training already; resume it or choose another output",
    )
    status, _, err = run(capsys, *arguments, "--max-epochs", 2, "--resume")
    assert (status, err.splitlines()[-1].endswith("as it was begun, max_epochs was 1, got 2")) == (2, True)


def test_a_scene_in_two_parts_is_refused(recordings, tmp_path, capsys):
    (recordings / "dev_set.txt").write_text("e.json\na.json")
    status, _, err = run(capsys, "train", "--data", recordings, "--output", tmp_path / "trained")
    assert (status, err.splitlines()[-1]) == (
        2,
        "reward_model: scene 'a' must be in one part only, it is in train and development",
    )
    assert not (tmp_path / "trained").exists()


def test_parts_that_are_not_there(recordings, tmp_path, capsys):
    (recordings / "dev_set.txt").unlink()
    status, _, err = run(capsys, "train", "--data", recordings, "--output", tmp_path / "trained")
    assert (status, err.count("must have a development part, got ['test', 'train']")) == (2, 1)
    status, _, err = run(capsys, "evaluate", "--data", recordings, "--part", "development")
    assert (status, err.count("has no development part, got ['test', 'train']")) == (2, 1)


def test_a_device_that_is_not_there(recordings, tmp_path, capsys):
    status, _, err = run(capsys, "train", "--data", recordings, "--output", tmp_path / "trained", "--device", "quantum")
    assert (status, err.startswith("reward_model: device must be one that PyTorch can use here, got 'quantum'")) == (
        2,
        True,
    )


def test_questions_that_nobody_was_asked_are_told(tmp_path, capsys):
    lines = [json.dumps({**RATING, "identifier": f"{number:05} A"}) for number in range(12)]
    (tmp_path / "ratings.jsonl").write_text("\n".join(lines))
    arguments = ("--data", tmp_path / "ratings.jsonl", "--held-out", 0.3)
    status, out, err = run(
        capsys, "train", *arguments, "--output", tmp_path / "trained", "--hidden-sizes", 2, "--max-epochs", 1
    )
    about = json.loads(out)
    assert (status, about["questions"]) == (0, ["q1"])
    assert sum(about["examples"].values()) == 12 + about["examples"]["train"] // 2
    assert "nobody was asked for Q2" in err
    status, out, _ = run(capsys, "evaluate", *arguments, "--weights", tmp_path / "trained", "--part", "test")
    assert (status, json.loads(out)["examples"]) == (0, about["examples"]["test"])
    assert "q2" not in json.loads(out)


def test_agreement_prints_matrices_and_the_ceiling(tmp_path, capsys):
    (tmp_path / "ratings.csv").write_text("clip,rater,q1\n1,a,0\n1,b,0\n2,a,100\n2,b,50\n")
    status, out, _ = run(capsys, "agreement", tmp_path / "ratings.csv")
    assert status == 0
    assert json.loads(out) == {
        "q1": {
            "raters": ["a", "b"],
            "kappa": [[None, 0.5], [0.5, None]],
            "counts": [[0, 2], [2, 0]],
            "ceiling": {"pairs": 0.125, "one_against_others": 0.125, "one_against_all": 0.03125, "clips": 2},
        }
    }


def test_agreement_of_nothing(capsys):
    assert run(capsys, "agreement") == (2, "", "reward_model: agreement needs at least one file\n")


def test_graphs_are_kept_for_the_next_time(recordings, tmp_path, capsys):
    first = run(capsys, "evaluate", "--data", recordings)
    (entry,) = (tmp_path / "cache" / "graphs").iterdir()
    (entry / "features.npy").unlink()
    status, _, err = run(capsys, "evaluate", "--data", recordings)
    assert (status, f"{entry}: this entry of the cache is damaged" in err) == (2, True)
    assert run(capsys, "evaluate", "--data", recordings, "--no-cache") == first


@contextmanager
def full_disk(size):
    """Files that may not grow beyond a size stand for a disk that is full; pytest's own output has room again after."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_full_disk_is_one_line_and_leaves_the_training_as_it_was(recordings, tmp_path, capsys):
    output = tmp_path / "trained"
    arguments = ("train", "--data", recordings, "--output", output, "--hidden-sizes", 4, "--max-epochs", 1)
    assert run(capsys, *arguments)[0] == 0
    (output / "model.safetensors").rename(tmp_path / "kept")
    before = {path: path.read_bytes() for path in output.glob("*.*")}
    with full_disk(2000):
        status, _, err = run(capsys, *arguments, "--resume")
    assert (status, err.count("\n"), err.startswith(f"reward_model: {tmp_path}/")) == (2, 1, True)
    assert err.endswith("/model.safetensors: File too large\n")
    assert {path: path.read_bytes() for path in output.glob("*.*")} == before


def test_a_full_disk_leaves_no_half_of_a_cache(recordings, tmp_path, capsys):
    with full_disk(1000):
        status, _, err = run(capsys, "evaluate", "--data", recordings)
        assert run(capsys, "evaluate", "--data", recordings, "--no-cache")[0] == 0
    assert (status, "the graphs cannot be kept" in err.splitlines()[-1]) == (2, True)
    assert "--no-cache does without" in err.splitlines()[-1]
    assert not list((tmp_path / "cache" / "graphs").iterdir())


def test_errors_on_other_data(recordings, tmp_path, capsys):
    """What is not split is split in two; no scene of the other data may be among it."""
    loose, other = tmp_path / "loose", tmp_path / "other"
    for folder, names in ((loose, "abcdefghij"), (other, "xyz")):
        folder.mkdir()
        for number, name in enumerate(names):
            recording(folder / f"{name}.json", label_Q1=10 * number)
    arguments = ("train", "--data", loose, "--hidden-sizes", 2, "--max-epochs", 1, "--held-out", 0.2, "--frames", 1)
    status, out, _ = run(capsys, *arguments, "--output", tmp_path / "trained", "--test", other)
    about = json.loads(out)
    assert (status, about["frames"], about["examples"]["test"]) == (0, 1, 3)
    assert about["examples"]["train"] + 2 * about["examples"]["development"] == 20
    status, out, _ = run(capsys, "evaluate", "--data", other, "--weights", tmp_path / "trained")
    assert json.loads(out)["q1"]["mse"] == pytest.approx(about["test_error"]["q1"], rel=1e-4)
    recording(other / "a.json")
    status, _, err = run(capsys, *arguments, "--output", tmp_path / "again", "--test", other)
    assert (status, "scene 'a' must be in one part only" in err) == (2, True)


def test_moments_need_a_teacher(capsys, recordings, tmp_path):
    arguments = ("train", "--data", recordings, "--output", tmp_path / "out", "--augment", "moments")
    status, _, err = run(capsys, *arguments)
    assert (status, "augmentation moments needs a teacher" in err) == (2, True)
    assert not (tmp_path / "out").exists()


def test_a_teacher_scores_the_copies(recordings, tmp_path):
    """The original keeps its label; a copy has the score that the network gives to the copy."""
    from rich.progress import Progress

    from reward_model.data.loading import DataConfig, load_parts

    with Progress(disable=True) as progress:
        plain, taught, again = (
            load_parts(DataConfig(recordings, "all", cache=tmp_path / "graphs", teacher=teacher), progress)["train"]
            for teacher in (None, "default", "default")
        )
    answers = load_scorer("default").score_windows(taught.windows[:]).clip(0, 1)
    copies = taught.variants > 0
    assert copies.sum() == 12
    assert (taught.scores[~copies] == plain.scores[~copies]).all()
    assert (taught.scores[copies] == answers[copies]).all()
    assert (again.scores == taught.scores).all() and (plain.scores[copies] != taught.scores[copies]).any()
