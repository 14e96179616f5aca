import numpy as np
import pytest

from reward_model.fast.scoring import Scoring, ScoringTogether
from reward_model.scenes.scene import Scores
from socnav_env.rewards.judging import Judging, judge
from tests.reward_model.random_scenes import random_windows


class Plain:
    """Gives windows its own number and that of the newest frame's nodes."""

    def __init__(self, number: int) -> None:
        self.name, self.number, self.calls = str(number), number, []

    def score_windows(self, windows) -> np.ndarray:
        self.calls.append(len(windows))
        return np.array([(self.number, len(window[0].kinds)) for window in windows], dtype=np.float32)


class Eager(Plain):
    """Likewise, and wants to be given its windows one by one."""

    def begin(self, num_windows: int) -> Scoring:
        self.calls.append(-num_windows)
        return ScoringTogether(self.score_windows)


@pytest.mark.parametrize("kind", [Plain, Eager])
def test_those_that_share_a_scorer_are_scored_together(kind):
    one, two = kind(1), kind(2)
    scorers = [one, None, two, one, one, None, two]
    windows = random_windows(51, count=len(scorers))
    judging = Judging(scorers)
    for window in windows:
        judging.add(window)
    numbers = [None if scorer is None else scorer.number for scorer in scorers]
    assert list(judging.scores()) == [
        None if number is None else Scores(number, len(window[0].kinds))
        for number, window in zip(numbers, windows, strict=True)
    ]
    assert [scorer.calls for scorer in (one, two)] == ([[3], [2]] if kind is Plain else [[-3, 3], [-2, 2]])


def test_nobody_to_judge():
    assert list(Judging([]).scores()) == []
    assert judge(None, []) is None


def test_one_window():
    (window,) = random_windows(52, count=1)
    assert judge(Plain(7), window) == Scores(7, len(window[0].kinds))
