import numpy as np
import pytest

from reward_model.fast.scoring import ScoringTogether
from tests.reward_model.random_scenes import random_windows


class Network:
    """Gives windows the number of their frames and of the newest one's nodes, and notes how many it is asked for."""

    def __init__(self) -> None:
        self.calls: list[int] = []

    def __call__(self, windows) -> np.ndarray:
        self.calls.append(len(windows))
        return np.array([(len(window), len(window[0].kinds)) for window in windows], dtype=np.float32)


@pytest.mark.parametrize("count", [1, 7])
def test_all_windows_are_scored_in_one_call(count):
    windows, network = random_windows(44, count), Network()
    scoring = ScoringTogether(network)
    for window in windows:
        scoring.add(window)
    assert network.calls == []
    assert list(scoring.scores()) == [[len(window), len(window[0].kinds)] for window in windows]
    assert network.calls == [count]


def test_no_window_needs_no_call():
    network = Network()
    assert list(ScoringTogether(network).scores()) == []
    assert network.calls == []


@pytest.mark.parametrize("number", [0, 4])
def test_a_window_of_another_number_of_frames_is_refused(number):
    frame = random_windows(46, count=1)[0][0]
    with pytest.raises(ValueError, match=f"a window must have 1 to 3 frames, got {number}"):
        ScoringTogether(Network()).add([frame] * number)
