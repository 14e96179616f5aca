import numpy as np
import pytest

from reward_model.scenes.scene import Scores
from reward_model.scorer import Assessment
from socnav_env.rewards.judging import judge, judge_all
from tests.reward_model.random_scenes import random_windows


class NumberedScorer:
    """Gives windows its own number and that of the newest frame's nodes."""

    def __init__(self, number: int) -> None:
        self.name, self.number, self.calls = str(number), number, []

    def score_windows(self, windows) -> np.ndarray:
        self.calls.append(len(windows))
        return np.array([(self.number, len(window[0])) for window in windows], dtype=np.float32)


def test_windows_that_share_a_scorer_are_scored_together():
    one, two = NumberedScorer(1), NumberedScorer(2)
    scorers = [one, None, two, one, one, None, two]
    windows = random_windows(51, count=len(scorers))
    assert judge_all(scorers, windows) == [
        None if scorer is None else Scores(scorer.number, len(window[0]))
        for scorer, window in zip(scorers, windows, strict=True)
    ]
    assert [scorer.calls for scorer in (one, two)] == [[3], [2]]


class UnsureScorer(NumberedScorer):
    """Knows deviations and its range, too."""

    def assess_windows(self, windows) -> Assessment:
        scores = self.score_windows(windows)
        return Assessment(scores, scores / 10, scores[:, 0] > 5)


def test_deviations_and_the_range_come_from_scorers_that_know_them():
    windows = random_windows(53, count=2)
    found = judge_all([UnsureScorer(7), UnsureScorer(3)], windows)
    sizes = [len(window[0]) for window in windows]
    assert [each[:2] for each in found] == [(7.0, sizes[0]), (3.0, sizes[1])]
    assert [each.q1_std for each in found] == pytest.approx([0.7, 0.3])
    assert [each.in_range for each in found] == [True, False]


def test_without_a_scorer_there_are_no_scores():
    assert judge_all([], []) == []
    assert judge(None, []) is None


def test_one_window():
    (window,) = random_windows(52, count=1)
    assert judge(NumberedScorer(7), window) == Scores(7, len(window[0]))
