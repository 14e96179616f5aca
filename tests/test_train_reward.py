"""`train_reward.py` with tiny numbers, and the weights that ship as the teacher."""

import json

import pytest

import socnav_env.simulated_data.labelled as labelled
from reward_model.networks.checkpoint import load_checkpoint
from reward_model.scorer import load_scorer
from socnav_env.simulated_data.labelled import load_shards
from train_reward import main

SMALL = ["--num-shards", "1", "--num-held-out", "1", "--hidden-sizes", "4", "--members", "2", "--max-epochs", "1"]


@pytest.fixture(autouse=True)
def small_shards(monkeypatch):
    monkeypatch.setattr(labelled, "EPISODES_PER_SHARD", 3)


def test_it_leaves_a_checkpoint_with_its_card(tmp_path, capfd):
    for folder in ("one", "other"):
        places = ["--work", str(tmp_path / f"work-{folder}"), "--output", str(tmp_path / folder)]
        assert main([*SMALL, *places, "--teacher", "default", "--jobs", "1"]) == 0
    printed = capfd.readouterr()
    checkpoint = load_checkpoint(tmp_path / "one")
    assert checkpoint.config.sizes == (42, 4, 2)
    assert checkpoint.config.options() == {"members": 2}
    assert json.loads(printed.out[: len(printed.out) // 2]) == checkpoint.about
    assert printed.err == ""
    names = ["README.md", "config.json", "model.safetensors"]
    assert sorted(path.name for path in (tmp_path / "one").iterdir()) == names
    card = (tmp_path / "one" / "README.md").read_text()
    assert f"(Bachiller et al. 2021) to {checkpoint.about['windows']['train']}\nwindows" in card
    weights = [(tmp_path / folder / "model.safetensors").read_bytes() for folder in ("one", "other")]
    assert weights[0] == weights[1]
    assert load_scorer(tmp_path / "one").training_range is not None


def test_a_finished_run_is_not_done_again(tmp_path, capfd):
    arguments = [*SMALL, "--work", str(tmp_path / "work"), "--output", str(tmp_path / "out"), "--teacher", "default"]
    assert main([*arguments, "--jobs", "1"]) == 0
    shard = tmp_path / "work" / "train" / "00000.npz"
    before = shard.stat().st_mtime_ns
    assert main([*arguments, "--jobs", "1"]) == 0
    assert shard.stat().st_mtime_ns == before
    capfd.readouterr()


def test_states_that_agents_visit_join_the_training(tmp_path, capfd):
    arguments = [*SMALL, "--teacher", "default", "--jobs", "1"]
    work, output = str(tmp_path / "work"), str(tmp_path / "out")
    agents = ["--agents", "straight", "random", "--shards-per-agent", "1"]
    assert main([*arguments, *agents, "--work", work, "--output", output]) == 0
    capfd.readouterr()
    visited = [load_shards(tmp_path / "work" / folder, 1) for folder in ("agent0", "agent1")]
    assert all(len(each.stars) > 0 for each in visited)
    about = load_checkpoint(tmp_path / "out").about
    simulated = len(load_shards(tmp_path / "work" / "train", 1).stars)
    assert about["windows"]["train"] == simulated + sum(len(each.stars) for each in visited)


def test_an_unknown_agent_is_named_before_anything_is_simulated(tmp_path, capfd):
    assert main(["--agents", "nobody", "--work", str(tmp_path / "work")]) == 2
    assert "no agent 'nobody'" in capfd.readouterr().err
    assert not (tmp_path / "work").exists()


def test_a_share_of_people_beyond_all_is_refused(capfd):
    assert main(["--people-share", "1.0"]) == 2
    assert "people_share must lie in 0..1, 1 excluded, got 1.0" in capfd.readouterr().err
