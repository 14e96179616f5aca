"""PPO learns, and a run can be left and picked up again."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from rich.console import Console

from agents.checkpoint import load_checkpoint
from agents.config import PPOConfig, RunConfig
from agents.envs import make_training_envs
from agents.evaluation import evaluate, evaluation_seeds
from agents.policy_files import load_agent
from agents.ppo import build_model, run_seed, train
from agents.storage import AgentError
from tests.agents.disc import DiscEnv

ROOT = Path(__file__).parents[2]
SMALL = RunConfig(
    total_timesteps=512,
    num_envs=4,
    num_workers=0,
    action_repeat=1,
    evaluation_interval=10_000,
    checkpoint_interval=128,
    ppo=PPOConfig(n_steps=32, batch_size=64, n_epochs=2, entity_width=8, net_arch=(8,)),
)
ENDLESS = """
import sys
from pathlib import Path
from rich.console import Console
from agents.run import run
from tests.agents.disc import DiscEnv
from tests.agents.test_ppo import ENDLESS_CONFIG
if __name__ == "__main__":
    sys.exit(0 if run(ENDLESS_CONFIG, Path(sys.argv[1]), DiscEnv, Console()) else 130)
"""
ENDLESS_CONFIG = replace(SMALL, total_timesteps=10**9, num_workers=2)


def quiet() -> Console:
    return Console(file=io.StringIO())


def test_learns_to_reach_a_goal_one_metre_away(tmp_path: Path) -> None:
    ppo = PPOConfig(n_steps=64, batch_size=512, n_epochs=8, learning_rate=3e-3, entity_width=16, net_arch=(32,))
    config = replace(SMALL, total_timesteps=16_384, num_envs=16, checkpoint_interval=10**6, ppo=ppo)
    history = train(config, DiscEnv, tmp_path, quiet())
    assert history is not None
    assert history.training[0]["success"] < 0.2
    result = evaluate(load_agent(tmp_path), DiscEnv, evaluation_seeds(10), jobs=1)
    assert result.summary["success"].mean >= 0.9


def test_resuming_counts_on_and_restores_everything(tmp_path: Path) -> None:
    first = train(SMALL, DiscEnv, tmp_path, quiet())
    assert first is not None
    checkpoint = load_checkpoint(tmp_path / "checkpoint.safetensors")
    assert checkpoint.actions == 512
    envs = make_training_envs(DiscEnv, SMALL.num_envs, 0)
    model = build_model(SMALL, envs, seed=99)
    checkpoint.restore(model)
    assert model.num_timesteps == 512
    assert model.get_vec_normalize_env().ret_rms.count == pytest.approx(512, abs=1)  # type: ignore[union-attr]
    step = model.policy.optimizer.state_dict()["state"][0]["step"]
    assert step == 512 / 64 * 2  # minibatches times epochs
    policy = load_agent(tmp_path)
    for name, weight in policy.named_parameters():  # type: ignore[attr-defined]
        torch.testing.assert_close(weight, dict(model.policy.named_parameters())[name], rtol=0, atol=0)
    longer = train(replace(SMALL, total_timesteps=1024), DiscEnv, tmp_path, quiet())
    assert longer is not None
    assert [row["timesteps"] for row in longer.training] == [128 * (row + 1) for row in range(8)]
    assert longer.training[:4] == first.training


def test_the_same_seed_gives_the_same_agent(tmp_path: Path) -> None:
    for name in "ab":
        (tmp_path / name).mkdir()
        train(SMALL, DiscEnv, tmp_path / name, quiet())
    assert (tmp_path / "a/agent.safetensors").read_bytes() == (tmp_path / "b/agent.safetensors").read_bytes()


def test_parts_of_a_run_get_seeds_of_their_own() -> None:
    assert len({run_seed(seed, timesteps) for seed in range(4) for timesteps in (0, 512)}) == 8


def test_a_checkpoint_of_other_sizes_is_refused(tmp_path: Path) -> None:
    train(SMALL, DiscEnv, tmp_path, quiet())
    wider = replace(SMALL, total_timesteps=1024, ppo=replace(SMALL.ppo, entity_width=16))
    with pytest.raises(AgentError, match=r"must have shape \(16,\), got \(8,\)"):
        train(wider, DiscEnv, tmp_path, quiet())


def test_survives_a_kill_and_stops_on_ctrl_c(tmp_path: Path) -> None:
    killed = start(tmp_path)
    wait_for(tmp_path / "checkpoint.safetensors", killed)
    os.killpg(killed.pid, signal.SIGKILL)
    killed.communicate()
    reached = load_checkpoint(tmp_path / "checkpoint.safetensors").actions
    (tmp_path / "agent.safetensors").unlink(missing_ok=True)

    stopped = start(tmp_path)
    time.sleep(0.1)
    before = (tmp_path / "checkpoint.safetensors").stat().st_mtime_ns
    while (tmp_path / "checkpoint.safetensors").stat().st_mtime_ns == before:
        assert stopped.poll() is None
        time.sleep(0.05)
    os.killpg(stopped.pid, signal.SIGINT)  # as a terminal does, to the workers too
    output, errors = stopped.communicate(timeout=30)
    assert stopped.returncode == 130
    assert "continue with: python train_agent.py --resume" in output
    assert errors == ""
    assert load_checkpoint(tmp_path / "checkpoint.safetensors").actions > reached
    assert (tmp_path / "agent.safetensors").is_file()


def start(folder: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", ENDLESS, str(folder)],
        cwd=ROOT,
        env={**os.environ, "COLUMNS": "200"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def wait_for(path: Path, process: subprocess.Popen[str]) -> None:
    while not path.exists():
        assert process.poll() is None, process.communicate()[1]
        time.sleep(0.05)
