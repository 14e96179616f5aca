import numpy as np
import pytest

import socnav_env.simulated_data.labelled as labelled
from reward_model.networks.checkpoint import CheckpointError
from socnav_env.simulated_data.labelled import ShardError, load_shards, simulate_shards


@pytest.fixture(autouse=True)
def small_shards(monkeypatch):
    monkeypatch.setattr(labelled, "EPISODES_PER_SHARD", 1)


def simulated(folder, num_shards=2, seed=5):
    return list(simulate_shards(folder, num_shards, seed, "default"))


def test_a_set_grows_shard_by_shard(tmp_path):
    assert simulated(tmp_path, 1) == [0, 1]
    assert simulated(tmp_path, 2) == [1, 2]
    one, both = load_shards(tmp_path, 1), load_shards(tmp_path, 2)
    count = len(one.stars)
    assert count < len(both.stars)
    assert both.images.shape == (len(both.stars), 4, 2)
    np.testing.assert_array_equal(both.images[:count], one.images)
    np.testing.assert_array_equal(both.stars.rooms[:count], one.stars.rooms)
    assert np.isfinite(both.images).all()


def test_other_seeds_and_teachers_need_other_folders(tmp_path):
    simulated(tmp_path, 1)
    with pytest.raises(ShardError, match=r"holds shards of .*'seed': 5.* choose another folder"):
        simulated(tmp_path, 1, seed=6)
    with pytest.raises(CheckpointError):
        list(simulate_shards(tmp_path / "none", 1, 0, str(tmp_path / "missing")))
    assert not (tmp_path / "none").exists()


def test_a_broken_shard_is_named(tmp_path):
    simulated(tmp_path, 1)
    (tmp_path / "00000.npz").write_bytes(b"broken")
    with pytest.raises(ShardError, match=r"00000.npz: not a readable shard .* delete it and simulate again"):
        load_shards(tmp_path, 1)


def test_a_missing_shard_is_named(tmp_path):
    simulated(tmp_path, 1)
    with pytest.raises(ShardError, match=r"00001.npz: not a readable shard"):
        load_shards(tmp_path, 2)


def test_a_broken_manifest_is_named(tmp_path):
    (tmp_path / "manifest.json").write_text("{")
    with pytest.raises(ShardError, match=r"manifest.json: not readable as JSON"):
        simulated(tmp_path, 1)
