import numpy as np
import pytest

from socnav_env.vector.infos import batch_infos, merged_infos, split_infos

INFOS = [
    {"outcome": None, "q1": 0.25, "reward_terms": {"social": -0.5, "contact": 0.0}, "is_success": False},
    {"outcome": "arrived", "q1": 0.75, "is_success": True, "episode_metrics": {"spl": 0.5}, "final_obs": {"a": 1}},
    {},
]


def test_splitting_undoes_gathering() -> None:
    batch = batch_infos(dict(enumerate(INFOS)), 3)
    split = split_infos(batch, 3)
    assert split == INFOS
    assert type(split[0]["q1"]) is float
    assert type(split[0]["is_success"]) is bool


def test_rows_of_arrays_are_kept() -> None:
    (first, second) = split_infos(batch_infos({1: {"pose": np.array([1.0, 2.0])}}, 2), 2)
    assert first == {}
    assert second["pose"].tolist() == [1.0, 2.0]


def test_an_action_of_several_periods_has_sums_of_terms_and_means_of_scores() -> None:
    infos = [
        {"outcome": None, "q2": 0.2, "in_range": False, "reward_terms": {"social": -0.8, "arrival": 0.0}},
        {"outcome": None, "q2": 0.4, "in_range": True, "reward_terms": {"social": -0.6, "arrival": 0.0}},
        {"outcome": "arrived", "q2": 0.9, "in_range": True, "reward_terms": {"social": -0.1, "arrival": 10.0}},
    ]
    merged = merged_infos(infos)
    assert merged == {
        "outcome": "arrived",
        "q2": pytest.approx(0.5),
        "in_range": False,
        "reward_terms": {"social": pytest.approx(-1.5), "arrival": 10.0},
        "control_steps": 3,
    }
    assert infos[-1]["q2"] == 0.9
