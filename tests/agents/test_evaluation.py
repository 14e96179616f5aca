"""Evaluation: records, intervals, and independence from the number of processes."""

from __future__ import annotations

import numpy as np
import pytest

from agents.baselines import RandomPolicy, StraightPolicy
from agents.evaluation import EpisodeRecord, bootstrap_interval, evaluate, evaluation_seeds, summarise
from tests.agents.disc import DiscEnv


def test_straight_reaches_the_goal_and_random_does_not() -> None:
    straight = evaluate(StraightPolicy(), DiscEnv, evaluation_seeds(8), jobs=1)
    assert [record.seed for record in straight.episodes] == list(range(1_000_000, 1_000_008))
    assert straight.summary["success"].mean == 1.0
    assert {record.outcome for record in straight.episodes} == {"arrived"}
    random = evaluate(RandomPolicy(), DiscEnv, evaluation_seeds(8), jobs=1)
    assert random.summary["success"].mean == 0.0
    assert random.summary["time_to_goal"].episodes == 0
    assert random.summary["length"].mean == 60


def test_number_of_jobs_changes_nothing() -> None:
    one, two = (evaluate(RandomPolicy(3), DiscEnv, evaluation_seeds(7), jobs=jobs) for jobs in (1, 2))
    np.testing.assert_equal(one.to_dict(), two.to_dict())


def test_interval_of_known_values() -> None:
    interval = bootstrap_interval(np.array([1.0, np.nan, 1.0, 1.0]))
    assert (interval.mean, interval.low, interval.high, interval.episodes) == (1.0, 1.0, 1.0, 3)
    halves = bootstrap_interval(np.repeat([0.0, 1.0], 50))
    assert halves.mean == 0.5
    # The binomial's normal approximation: 0.5 +- 1.96 * sqrt(0.25 / 100)
    assert (halves.low, halves.high) == pytest.approx((0.402, 0.598), abs=0.02)


def test_measures_that_only_some_episodes_have() -> None:
    records = [
        EpisodeRecord(1, "arrived", 2.0, 10, {"time_to_goal": 2.0}),
        EpisodeRecord(2, "timeout", -1.0, 60, {"time_to_goal": float("nan")}),
        EpisodeRecord(3, "collision_wall", -3.0, 5, {}),
    ]
    summary = summarise(records)
    assert summary["success"].mean == pytest.approx(1 / 3)
    assert summary["return"].mean == pytest.approx(-2 / 3)
    assert (summary["time_to_goal"].mean, summary["time_to_goal"].episodes) == (2.0, 1)
