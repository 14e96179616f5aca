import numpy as np

from reward_model.scenes.scene import Scores
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


def test_without_a_scorer_there_are_no_scores():
    assert judge_all([], []) == []
    assert judge(None, []) is None


def test_one_window():
    (window,) = random_windows(52, count=1)
    assert judge(NumberedScorer(7), window) == Scores(7, len(window[0]))
