"""`train_reward.py` with tiny numbers, and the weights that ship as the teacher."""

import json

import pytest

import reward_model.scorer
from reward_model.networks.checkpoint import load_checkpoint
from reward_model.scorer import load_scorer
from train_reward import main


@pytest.fixture(autouse=True)
def teacher(monkeypatch):
    default = load_scorer("default")
    monkeypatch.setattr(reward_model.scorer, "load_scorer", lambda weights: default)


def test_it_leaves_a_checkpoint_with_its_card(tmp_path, capfd):
    arguments = ["--num-windows", "10", "--num-held-out", "4", "--hidden-sizes", "4", "--max-epochs", "2"]
    for folder in ("one", "other"):
        assert main([*arguments, "--jobs", "1", "--output", str(tmp_path / folder)]) == 0
    printed = capfd.readouterr()
    checkpoint = load_checkpoint(tmp_path / "one")
    assert checkpoint.about["windows"] == {"train": 10, "development": 4, "test": 4}
    assert checkpoint.config.sizes == (42, 4, 2)
    assert json.loads(printed.out[: len(printed.out) // 2]) == checkpoint.about
    assert printed.err == ""
    assert sorted(path.name for path in (tmp_path / "one").iterdir()) == [
        "README.md",
        "config.json",
        "model.safetensors",
    ]
    assert "(Bachiller et al. 2021) to 10\nwindows" in (tmp_path / "one" / "README.md").read_text()
    weights = [(tmp_path / folder / "model.safetensors").read_bytes() for folder in ("one", "other")]
    assert weights[0] == weights[1]
