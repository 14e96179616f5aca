import json

import pytest

from reward_model.data.examples import DatasetError
from reward_model.data.loading import DataConfig
from reward_model.networks.registry import GATConfig, MPNNConfig
from reward_model.studies import experiments
from reward_model.studies.experiments import RECIPES, Recipe, Row, Setting, experiment, markdown
from reward_model.training.fit import TrainingConfig
from reward_model.training.state import TrainingStateError
from tests.reward_model.scenes.test_socnav1 import RATING


@pytest.fixture
def data(tmp_path, monkeypatch):
    """Forty rated scenes, a tiny network of each of two kinds."""
    lines = [json.dumps({**RATING, "identifier": f"{number:05} A", "score": number}) for number in range(40)]
    (tmp_path / "ratings.jsonl").write_text("\n".join(lines[:30]))
    (tmp_path / "others.jsonl").write_text("\n".join(lines[30:]))
    training = TrainingConfig(max_epochs=2, learning_rate=1e-2)
    settings = {
        "gat": Setting(GATConfig((42, 2, 2), num_heads=2, negative_slope=0.2), training),
        "mpnn": Setting(MPNNConfig((42, 2, 2), "tabulated"), training),
    }
    monkeypatch.setattr(experiments, "RECIPES", {"static": Recipe("mirror", 1, 0.2, settings)})
    return DataConfig(
        tmp_path / "ratings.jsonl", held_out=0.2, cache=tmp_path / "cache", frames=1, test=tmp_path / "others.jsonl"
    )


def test_an_experiment_is_one_table(data, tmp_path):
    pytest.importorskip("dgl")
    output = tmp_path / "out"
    table = experiment(data, "static", output, seeds=(0, 1))
    assert (output / "results.md").read_text() == table
    names = [line.split(" | ")[0].removeprefix("| ") for line in table.splitlines()]
    assert [names[0], *names[2:]] == [
        "network",
        "GAT",
        "MPNN",
        *(f"ensemble: mean of {each}" for each in ("2 GAT", "2 MPNN", "all 4")),
    ]
    found = json.loads((output / "results.json").read_text())
    trainings = found["trainings"]
    assert sorted(trainings) == ["gat-0", "gat-1", "mpnn-0", "mpnn-1"]
    for name, numbers in zip(("gat-0", "gat-1"), found["rows"]["GAT"], strict=True):
        assert numbers["q1 test MSE"] == pytest.approx(trainings[name]["test_error"]["q1"], rel=1e-4)
        assert trainings[name]["examples"]["test"] == 10
    images = sorted(path.name for path in output.glob("*.png"))
    assert images == ["absolute_errors_gat_q1.png", "absolute_errors_mpnn_q1.png"]
    before = {path: path.stat().st_mtime_ns for path in output.glob("sessions/*/result.json")}
    again = experiment(data, "static", output, seeds=(0, 1, 2), resume=True)
    assert "| ensemble: mean of all 6 |" in again and len(list(output.glob("sessions/*/result.json"))) == 6
    assert before == {path: path.stat().st_mtime_ns for path in before}


def test_another_experiment_is_refused(data, tmp_path):
    pytest.importorskip("dgl")
    experiment(data, "static", tmp_path / "out", seeds=(0,))
    with pytest.raises(DatasetError, match=r"holds an experiment already; resume it or choose another output$"):
        experiment(data, "static", tmp_path / "out", seeds=(0,))
    with pytest.raises(TrainingStateError, match=r"an experiment is gone on with as it was begun, gat was \["):
        experiment(data, "static", tmp_path / "out", seeds=(0,), resume=True, max_epochs=5)
    (tmp_path / "out" / "experiment.json").write_text("{")
    with pytest.raises(DatasetError, match=r"experiment\.json: not readable as JSON"):
        experiment(data, "static", tmp_path / "out", seeds=(0,), resume=True)


def test_an_experiment_needs_something_to_test_on(data, tmp_path):
    lines = (tmp_path / "ratings.jsonl").read_text().splitlines()
    (tmp_path / "split").mkdir()
    for name, part in (("train", lines[:20]), ("dev", lines[20:])):
        (tmp_path / "split" / f"{name}.jsonl").write_text("\n".join(part))
    with pytest.raises(DatasetError, match=r"an experiment needs a test part, got \['development', 'train'\]$"):
        experiment(DataConfig(tmp_path / "split"), "static", tmp_path / "out")


def test_means_and_deviations_over_seeds():
    numbers = [
        {"parameters": 1200, "epoch kept": 3, "train MSE": 0.01, "development MSE": error, "q1 test MSE": error}
        for error in (0.02, 0.04)
    ]
    rows = [Row("MPNN", numbers), Row("mean of 2 MPNN", [{"q1 test MSE": 0.025}])]
    assert markdown(rows).splitlines()[2:] == [
        "| MPNN | 1,200 | 3 | 0.0100 ± 0.0000 | 0.0300 ± 0.0141 | 0.0300 ± 0.0141 |",
        "| mean of 2 MPNN |  |  |  |  | 0.0250 |",
    ]


def test_every_recipe_has_the_papers_three_networks():
    for recipe in RECIPES.values():
        assert [(name, setting.network.kind) for name, setting in recipe.settings.items()] == [
            ("rgcn", "rgcn"),
            ("gat", "gat"),
            ("mpnn", "mpnn"),
        ]


def test_peoples_scores_need_no_teacher_and_simulated_ones_do(tmp_path):
    for kind in ("static", "sequences"):
        DataConfig(tmp_path, RECIPES[kind].augmentation)
    with pytest.raises(DatasetError, match="needs a teacher"):
        DataConfig(tmp_path, RECIPES["simulated"].augmentation)
