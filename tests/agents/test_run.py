"""A whole run: its files; and what the commands say to bad input."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path

import imageio.v3 as imageio
import pytest
from rich.console import Console

from agents.__main__ import main as agents_main
from agents.config import RunConfig
from agents.run import new_folder, read_run, run
from agents.storage import AgentError
from agents.training_command import main as train_main
from tests.agents.disc import DiscEnv
from tests.agents.test_ppo import SMALL


def test_a_run_leaves_everything_it_promises(tmp_path: Path) -> None:
    config = replace(SMALL, eval_episodes=3, evaluation_interval=256, evaluation_episodes=2)
    console = Console(file=io.StringIO(), width=200)
    assert run(config, tmp_path, DiscEnv, console)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "agent.safetensors",
        "checkpoint.safetensors",
        "config.json",
        "episode.gif",
        "eval.json",
        "learning_curve.png",
        "tensorboard",
    ]
    assert read_run(tmp_path) == config
    result = json.loads((tmp_path / "eval.json").read_text())
    assert list(result["agents"]) == ["ppo", "random", "straight"]
    assert result["agents"]["straight"]["summary"]["success"] == {"mean": 1.0, "low": 1.0, "high": 1.0, "episodes": 3}
    assert [item["seed"] for item in result["agents"]["random"]["episodes"]] == [1_000_000, 1_000_001, 1_000_002]
    episodes = result["agents"]["ppo"]["episodes"]
    length = max((item["outcome"] == "arrived", item["length"]) for item in episodes)[1]
    assert len(imageio.imread(tmp_path / "episode.gif", index=...)) == length + 1
    assert "straight" in console.file.getvalue()  # type: ignore[attr-defined]
    with pytest.raises(AgentError, match="already holds a run; continue it with --resume"):
        new_folder(config, tmp_path)


def test_configs_survive_json() -> None:
    config = replace(SMALL, environment={"time_limit": 30.0})
    assert RunConfig.from_dict(json.loads(json.dumps(config.to_dict())), "here") == config
    with pytest.raises(AgentError, match="here: ppo: unknown key gama; valid are batch_size"):
        RunConfig.from_dict({"ppo": {"gama": 0.9}}, "here")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["--reward", "lerned"],
            "reward must be one of learned, q1, q2, crowdnav, dsrnn, sparse, mix or",
        ),
        (["--total-timesteps", "-5"], "total_timesteps must be at least 1, got -5"),
        (["--num-envs", "0"], "num_envs must be at least 1, got 0"),
        (["--ppo.gamma", "1.5"], "ppo.gamma must be from 0 to 1, got 1.5"),
        (["--resume", "nowhere"], "nowhere: is no training run: it has no config.json"),
        (["--resume", "a", "--output-dir", "b"], "give either --output-dir"),
        (["--env-config", "missing.json"], "missing.json: cannot be read: No such file or directory"),
    ],
)
def test_train_refuses_bad_input_in_one_line(
    arguments: list[str],
    message: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert train_main(arguments) == 2
    errors = capsys.readouterr().err
    assert errors.startswith("train_agent.py: ")
    assert message in errors
    assert errors.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_resumed_run_keeps_its_settings(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "config.json").write_text(json.dumps(replace(SMALL, reward="sparse").to_dict()))
    assert train_main(["--resume", str(tmp_path), "--reward", "crowdnav"]) == 2
    assert "its reward is 'sparse' and cannot become 'crowdnav'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["evaluate", "nobody"], "no agent 'nobody'; valid are random, straight"),
        (["evaluate", "random", "--episodes", "0"], "episodes must be at least 1, got 0"),
        (["evaluate", "random", "--reward", "none"], "reward must be one of learned"),
    ],
)
def test_evaluate_refuses_bad_input_in_one_line(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert agents_main(arguments) == 2
    errors = capsys.readouterr().err
    assert message in errors
    assert errors.count("\n") == 1


def test_an_agent_is_evaluated_in_a_scenario(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "evaluation.json"
    arguments = ["evaluate", "straight", "--episodes", "2", "--jobs", "1", "--reward", "sparse", "--scenario"]
    assert agents_main([*arguments, "person_at_laptop", "--output", str(output)]) == 0
    assert json.loads(output.read_text())["scenario"] == "person_at_laptop"
    capsys.readouterr()
    assert agents_main([*arguments, "moon"]) == 2
    assert "scenario must be one of blind_corner" in capsys.readouterr().err
    assert train_main(["--scenario", "moon", "--output-dir", str(tmp_path / "run")]) == 2
    assert not (tmp_path / "run").exists()
