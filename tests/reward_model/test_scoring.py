from concurrent.futures import ThreadPoolExecutor
from functools import partial
from threading import Event, current_thread

import numpy as np
import pytest

from reward_model.scoring import Scoring, scoring_together
from tests.reward_model.random_scenes import random_windows


class Network:
    """Gives windows the number of their frames and of the newest one's nodes, and notes who was asked for how many."""

    def __init__(self) -> None:
        self.calls: list[tuple[str, int]] = []

    def __call__(self, windows) -> np.ndarray:
        self.calls.append((current_thread().name.partition("_")[0], len(windows)))
        return np.array([(len(window), len(window[0].kinds)) for window in windows], dtype=np.float32)

    def prepare(self, windows):
        return partial(self, windows)


@pytest.fixture
def network() -> Network:
    return Network()


def scores_by(scoring: Scoring, windows) -> list[tuple[float, float]]:
    for window in windows:
        scoring.add(window)
    return list(scoring.scores())


def expected(windows) -> list[list[float]]:
    return [[len(window), len(window[0].kinds)] for window in windows]


@pytest.mark.parametrize("count", [0, 1, 3, 4, 11])
def test_scores_come_in_the_order_of_their_windows(network, count):
    windows = random_windows(41, count=11)[:count]
    with ThreadPoolExecutor(2) as threads:
        assert scores_by(Scoring(network.prepare, threads, group_size=4), windows) == expected(windows)
    assert sorted(size for _, size in network.calls) == sorted([4] * (count // 4) + [count % 4] * (count % 4 > 0))


def test_threads_begin_before_the_last_window_has_come(network):
    windows = random_windows(42, count=5)
    with ThreadPoolExecutor(1, "others") as threads:
        scoring = Scoring(network.prepare, threads, group_size=2)
        for window in windows[:4]:
            scoring.add(window)
        threads.submit(int).result()  # stands behind them in the queue
        assert network.calls == [("others", 2), ("others", 2)]
        scoring.add(windows[4])
        assert list(scoring.scores()) == expected(windows)
    assert network.calls[2:] == [(current_thread().name, 1)]


def test_what_no_thread_has_begun_with_is_done_at_once(network):
    windows, free = random_windows(43, count=4), Event()
    with ThreadPoolExecutor(1) as threads:
        threads.submit(free.wait)
        assert scores_by(Scoring(network.prepare, threads, group_size=2), windows) == expected(windows)
        free.set()
    assert network.calls == [(current_thread().name, 2)] * 2


def test_without_threads_all_windows_are_scored_in_one_call(network):
    windows = random_windows(44, count=7)
    assert scores_by(scoring_together(network), windows) == expected(windows)
    assert network.calls == [(current_thread().name, 7)]


def test_an_error_in_a_thread_reaches_who_asks_for_the_scores():
    def fail(windows):
        raise MemoryError("no room")

    with ThreadPoolExecutor(1) as threads:
        scoring = Scoring(lambda windows: partial(fail, windows), threads)
        scoring.add(random_windows(45, count=1)[0])
        with pytest.raises(MemoryError, match="no room"):
            list(scoring.scores())


@pytest.mark.parametrize("number", [0, 4])
def test_a_window_of_another_number_of_frames_is_refused(network, number):
    frame = random_windows(46, count=1)[0][0]
    with pytest.raises(ValueError, match=f"a window must have 1 to 3 frames, got {number}"):
        scoring_together(network).add([frame] * number)
