"""A search that is interrupted ends with the same sessions as one that is not."""

import json
import resource
import signal
import subprocess
import sys
import time

import optuna
import pytest

from reward_model.commands.main import main
from reward_model.data.examples import DatasetError
from reward_model.data.loading import DataConfig
from reward_model.studies import search as search_module
from reward_model.studies.search import SearchConfig, search
from reward_model.studies.search_report import Finished, best_of_blocks, markdown, write_reports
from reward_model.studies.search_space import SearchSpace
from reward_model.training.fit import DivergedError
from reward_model.training.state import TrainingStateError
from tests.reward_model.scenes.test_socnav1 import RATING

SMALL = SearchSpace(("mpnn",), hidden_units=(2, 6), layers=(2, 3), learning_rate=(1e-3, 1e-2), max_epochs=3)


@pytest.fixture
def data(tmp_path):
    lines = [json.dumps({**RATING, "identifier": f"{number:05} A", "score": number}) for number in range(40)]
    (tmp_path / "ratings.jsonl").write_text("\n".join(lines))
    return DataConfig(tmp_path / "ratings.jsonl", held_out=0.2, frames=1, cache=tmp_path / "cache")


def outcomes(rows: list[Finished]):
    return [(row.number, row.params, row.result["development_error"], row.result["test_error"]) for row in rows]


def test_the_papers_best_network_can_be_drawn():
    space = SearchSpace()
    params = {"block": "mpnn", "hidden_units": 40, "layers": 6, "batch_size": 57, "learning_rate": 2.5e-4}
    assert space.network(params).sizes == (42, 40, 30, 21, 12, 3, 2)
    training = space.training({**params, "weight_decay": 1e-6}, 7, "cpu")
    assert (training.max_epochs, training.patience, training.batch_size, training.seed) == (1000, 4, 57, 7)


def test_draws_stay_what_they_are():
    """Old studies are gone on with: what the first session of each network draws, in this order."""
    assert [list(SearchSpace().draw(0, number).params.items()) for number in range(3)] == [
        [
            ("block", "rgcn"),
            ("batch_size", 49),
            ("hidden_units", 60),
            ("layers", 4),
            ("num_bases", 12),
            ("learning_rate", 0.00038760875227936115),
            ("weight_decay", 5.84839760393515e-07),
            ("dropout", 5.757294277848633e-07),
        ],
        [
            ("block", "gat"),
            ("batch_size", 69),
            ("hidden_units", 45),
            ("layers", 9),
            ("num_heads", 3),
            ("learning_rate", 0.00021617071553368367),
            ("weight_decay", 6.90326257979714e-07),
            ("dropout", 7.070560066167039e-07),
            ("negative_slope", 0.2093097794458988),
        ],
        [
            ("block", "mpnn"),
            ("batch_size", 50),
            ("hidden_units", 25),
            ("layers", 9),
            ("learning_rate", 0.0004467799958521294),
            ("weight_decay", 7.339507551801557e-07),
        ],
    ]


def test_draws_lie_in_the_ranges_and_follow_from_seed_and_number():
    space = SearchSpace()
    draws = [space.draw(3, number).params for number in range(60)]
    assert draws[:5] == [SearchSpace().draw(3, number).params for number in range(5)]
    assert draws[0] != space.draw(4, 0).params and draws[0] != draws[3]
    assert [params["block"] for params in draws[:4]] == ["rgcn", "gat", "mpnn", "rgcn"]
    own = {"rgcn": {"num_bases", "dropout"}, "gat": {"num_heads", "negative_slope", "dropout"}, "mpnn": set()}
    for params in draws:
        common = {"block", "batch_size", "hidden_units", "layers", "learning_rate", "weight_decay"}
        assert set(params) == common | own[params["block"]]
        for name in set(params) - {"block"}:
            low, high = getattr(space, name)
            assert low <= params[name] <= high
        assert len(space.network(params).sizes) == params["layers"] + 1
    assert {params["layers"] for params in draws} == set(range(3, 10))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"layers": (1, 3)}, "layers must be at least 2, got 1"),
        ({"num_heads": (0, 3)}, "num_heads must be at least 1, got 0"),
        ({"dropout": (0.0, 1.0)}, "dropout must lie in 0..1, 1 excluded, got 1.0"),
        ({"edge_network": "deep"}, r"edge_network must be one of \['perceptron', 'tabulated'\], got 'deep'"),
        ({"learning_rate": (1e-3, 1e-4)}, "learning_rate must be a range from low to high, not below 0, got"),
        ({"blocks": ()}, r"blocks must name at least one network, each once, got \[\]"),
        ({"blocks": ("gat", "gat")}, "blocks must name at least one network, each once"),
    ],
)
def test_impossible_spaces(options, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        SearchSpace(**options)


def test_sessions_are_the_same_in_parts(data, tmp_path):
    whole = search(data, SMALL, SearchConfig(4), tmp_path / "whole")
    first = search(data, SMALL, SearchConfig(1), tmp_path / "parts")
    again = search(data, SMALL, SearchConfig(4), tmp_path / "parts", resume=True)
    assert [row.number for row in again] == [0, 1, 2, 3]
    assert outcomes(again) == outcomes(whole)
    assert outcomes(first) == outcomes(whole)[:1]
    best = min(whole, key=lambda row: row.development)
    weights = sorted((tmp_path / "whole" / "sessions").glob("*/model.safetensors"))
    assert [path.parent.name for path in weights] == [f"{best.number:04}"]
    (table,) = json.loads((tmp_path / "whole" / "results.json").read_text())
    assert (table["session"], table["sessions"], table["development"]) == (best.number, 4, best.development)
    assert len((tmp_path / "whole" / "sessions.csv").read_text().splitlines()) == 5
    study = optuna.load_study(study_name="search", storage=f"sqlite:///{tmp_path / 'whole' / 'study.db'}")
    assert study.best_trial.number == best.number
    assert (study.best_value, study.best_params) == (best.development, best.params)


def test_a_killed_search_loses_no_session_and_runs_none_twice(data, tmp_path, monkeypatch):
    """Two at a time until it is killed, then one by one."""
    monkeypatch.setenv("SOCNAV_CACHE", str(tmp_path / "cache"))
    output = tmp_path / "killed"
    options = (
        "--held-out",
        "0.2",
        "--frames",
        "1",
        "--blocks",
        "mpnn",
        "--hidden-units",
        "2",
        "6",
        "--layers",
        "2",
        "3",
    )
    options += ("--learning-rate", "1e-3", "1e-2", "--max-epochs", "12", "--patience", "12", "--sessions", "4")
    command = ["search", "--data", str(data.path), "--output", str(output), *options]
    arguments = [sys.executable, "-m", "reward_model", *command, "--jobs", "2"]
    results = output / "sessions"
    with subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        while not list(results.glob("*/result.json")) and process.poll() is None:
            time.sleep(0.005)
        process.send_signal(signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    over = {path: path.stat().st_mtime_ns for path in results.glob("*/result.json")}
    assert 1 <= len(over) < 4
    assert main([*command, "--resume"]) == 0
    assert sorted(path.parent.name for path in results.glob("*/result.json")) == [f"{number:04}" for number in range(4)]
    assert over == {path: path.stat().st_mtime_ns for path in over}
    assert not list(results.glob("*/training_state.safetensors"))
    assert main([*command[:4], str(tmp_path / "whole"), *options]) == 0
    assert (output / "sessions.csv").read_bytes() == (tmp_path / "whole" / "sessions.csv").read_bytes()


@pytest.mark.parametrize(
    ("space", "config", "other_data", "message"),
    [
        ({"batch_size": (25, 30)}, {}, False, r"batch_size was \[25, 70\], got \[25, 30\]$"),
        ({}, {"seed": 1}, False, "seed was 0, got 1$"),
        ({}, {}, True, "test_data was "),
    ],
)
def test_another_search_is_not_gone_on_with(data, tmp_path, space, config, other_data, message):
    search(data, SMALL, SearchConfig(1), tmp_path / "out")
    if other_data:
        text = data.path.read_text().replace('"score": 1', '"score": 2')
        data.path.write_text(text)
    before = (tmp_path / "out" / "study.db").read_bytes()
    other = SearchSpace(**{name: getattr(SMALL, name) for name in vars(SMALL)} | space)
    with pytest.raises(TrainingStateError, match=rf"study\.db: a study is gone on with as it was begun, {message}"):
        search(data, other, SearchConfig(2, **config), tmp_path / "out", resume=True)
    assert (tmp_path / "out" / "study.db").read_bytes() == before


def test_options_of_networks_that_are_not_searched_among_say_nothing(data, tmp_path):
    """As in studies that are older than a network."""
    rows = search(data, SMALL, SearchConfig(1), tmp_path / "out")
    other = SearchSpace(**{name: getattr(SMALL, name) for name in vars(SMALL)} | {"num_heads": (3, 4)})
    assert "num_heads" not in other.document()
    assert search(data, other, SearchConfig(1), tmp_path / "out", resume=True) == rows
    storage = optuna.storages.RDBStorage(f"sqlite:///{tmp_path / 'out' / 'study.db'}")
    study = optuna.load_study(study_name="search", storage=storage)
    study.set_user_attr("search", study.user_attrs["search"] | {"num_heads": [3, 10]})
    assert search(data, SMALL, SearchConfig(1), tmp_path / "out", resume=True) == rows
    storage.engine.dispose()


def test_an_impossible_range_is_one_line(capsys, tmp_path):
    arguments = ("search", "--data", "ratings.jsonl", "--output", str(tmp_path / "out"), "--num-bases", "0", "3")
    assert main(arguments) == 2
    assert capsys.readouterr().err == "reward_model: num_bases must be at least 1, got 0\n"


def test_a_search_is_neither_overwritten_nor_resumed_from_nothing(data, tmp_path):
    with pytest.raises(DatasetError, match=r"there is no search to go on with; start one without resume$"):
        search(data, SMALL, SearchConfig(1), tmp_path / "out", resume=True)
    search(data, SMALL, SearchConfig(1), tmp_path / "out")
    with pytest.raises(DatasetError, match=r"holds a search already; resume it or choose another output$"):
        search(data, SMALL, SearchConfig(1), tmp_path / "out")
    (tmp_path / "out" / "study.db").write_bytes(b"no database at all" * 100)
    with pytest.raises(OSError, match=r"study\.db: the study cannot be read or written \(.+\)$"):
        search(data, SMALL, SearchConfig(1), tmp_path / "out", resume=True)


def test_two_searches_at_once_are_refused(data, tmp_path):
    search(data, SMALL, SearchConfig(1), tmp_path / "out")
    with (
        search_module._alone(tmp_path / "out"),
        pytest.raises(DatasetError, match=r"another search is running in this folder; wait for its end$"),
    ):
        search(data, SMALL, SearchConfig(2), tmp_path / "out", resume=True)


def test_a_full_disk_leaves_what_was_there(data, tmp_path):
    """Files that may not grow stand for a disk that is full."""
    output = tmp_path / "out"
    rows = search(data, SMALL, SearchConfig(1), output)
    before = {path: path.read_bytes() for path in output.rglob("*") if path.is_file()}
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (256, hard))
    try:
        with pytest.raises(OSError) as caught:
            search(data, SMALL, SearchConfig(2), output, resume=True)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert str(caught.value).count("\n") == 0
    assert {path: path.read_bytes() for path in before} == before
    again = search(data, SMALL, SearchConfig(2), output, resume=True)
    assert outcomes(again)[:1] == outcomes(rows) and len(again) == 2


def test_a_session_that_gets_out_of_hand_is_no_best_one(data, tmp_path, monkeypatch):
    def diverged(*arguments, **options):
        raise DivergedError("training got out of hand")

    monkeypatch.setattr("reward_model.training.parallel.learn", diverged)
    (row,) = search(data, SMALL, SearchConfig(1), tmp_path / "out")
    assert row.result == {"failed": "training got out of hand"}
    assert best_of_blocks([row]) == []
    assert search(data, SMALL, SearchConfig(1), tmp_path / "out", resume=True) == [row]


@pytest.mark.parametrize("options", [{"sessions": 0}, {"jobs": 0}])
def test_impossible_searches(options):
    with pytest.raises(ValueError, match=r"must be at least 1, got 0$"):
        SearchConfig(**options)


def result(development: float, test: dict[str, float] | None = None) -> dict:
    tested = {} if test is None else {"test_error": test}
    return {"train_error": 0.0173, "development_error": development, "epochs": 9, "parameters": 1234, **tested}


ROWS = [
    Finished(0, {"block": "mpnn", "layers": 6}, result(0.036821, {"q1": 0.03, "q2": 0.04})),
    Finished(1, {"block": "gat", "layers": 4, "weight_decay": 5e-7}, result(0.0378)),
    Finished(2, {"block": "mpnn", "layers": 3}, result(0.05)),
    Finished(3, {"block": "mpnn", "layers": 3}, {"failed": "training got out of hand"}),
]


def test_the_table_has_the_best_of_each_block_in_the_papers_order():
    assert markdown(best_of_blocks(ROWS)).splitlines() == [
        "| block | sessions | session | train | development | test | epochs | parameters | drawn |",
        "|---|---|---|---|---|---|---|---|---|",
        "| GAT | 1 | 1 | 0.017300 | 0.037800 |  | 9 | 1234 | layers 4, weight_decay 5e-07 |",
        "| MPNN | 3 | 0 | 0.017300 | 0.036821 | 0.035000 | 9 | 1234 | layers 6 |",
    ]


def test_reports_on_disk(tmp_path):
    write_reports(ROWS, tmp_path)
    assert (tmp_path / "results.csv").read_text().splitlines()[0] == (
        "sessions,session,train,development,epochs,parameters,test,block,layers,weight_decay"
    )
    assert [row["block"] for row in json.loads((tmp_path / "results.json").read_text())] == ["gat", "mpnn"]
    assert (tmp_path / "sessions.csv").read_text().splitlines()[4] == "3,,,,,,mpnn,3,"
