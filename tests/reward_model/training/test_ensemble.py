from dataclasses import replace

import numpy as np
import pytest
import torch

from reward_model.data.labelled_windows import LabelledWindows
from reward_model.networks.checkpoint import Checkpoint
from reward_model.networks.registry import StarConfig
from reward_model.scorer import SocialScorer
from reward_model.training.ensemble import train_members, united
from reward_model.training.fit import TrainingConfig
from tests.reward_model.random_scenes import random_windows

SIZES = (42, 6, 2)


def labelled(seed: int) -> LabelledWindows:
    scores = np.random.default_rng(seed).uniform(0.1, 0.9, (8, 2)).astype(np.float32)
    return LabelledWindows(random_windows(seed, 8), scores)


PARTS = {"train": labelled(0), "development": labelled(1)}
CONFIG = TrainingConfig(max_epochs=2, batch_size=4, learning_rate=1e-2, seed=5, optimizer="muon")


def trained(folder, count: int = 2) -> list[Checkpoint]:
    return sorted(train_members(SIZES, CONFIG, PARTS, count, folder), key=lambda each: each.about["training"]["seed"])


def test_the_union_scores_with_the_mean_of_its_members(tmp_path):
    members = trained(tmp_path)
    assert [member.about["training"]["seed"] for member in members] == [5, 6]
    ensemble = united(members)
    assert ensemble.config == StarConfig(SIZES, 2)
    assert len(ensemble.about["members"]) == 2
    windows = random_windows(3, 5)
    each = np.stack([SocialScorer(member, "one").score_windows(windows) for member in members])
    found = SocialScorer(ensemble, "both").assess_windows(windows)
    np.testing.assert_allclose(found.deviations, each.std(axis=0), atol=1e-6)
    assert found.deviations.max() > 1e-4


def test_members_that_are_done_are_read_and_interrupted_ones_go_on(tmp_path):
    first = trained(tmp_path / "one")
    again = trained(tmp_path / "one")
    fresh = trained(tmp_path / "other", 1)
    for one, other in ((first[0], again[0]), (first[0], fresh[0])):
        assert all(torch.equal(one.tensors[name], other.tensors[name]) for name in one.tensors)
    assert (tmp_path / "one" / "member0" / "epochs.txt").read_text().count("\n") == 2


def test_members_with_other_options_or_data_are_not_taken_for_these(tmp_path):
    trained(tmp_path, 1)
    other = replace(CONFIG, max_epochs=3)
    for config, parts in ((other, PARTS), (CONFIG, {**PARTS, "train": labelled(2)})):
        with pytest.raises(ValueError, match="member0: holds a member with other options or data; delete it or"):
            list(train_members(SIZES, config, parts, 1, tmp_path))


def test_members_of_other_windows_do_not_unite(tmp_path):
    one = trained(tmp_path / "one", 1)
    (other,) = train_members(SIZES, CONFIG, {**PARTS, "train": labelled(2)}, 1, tmp_path / "other")
    with pytest.raises(ValueError, match="trained on the same windows"):
        united([*one, other])
