import time
import weakref
from concurrent.futures import ThreadPoolExecutor
from threading import Event

import numpy as np
import pytest

from reward_model.fast import ahead
from reward_model.fast.ahead import ScoringAhead
from reward_model.fast.grouped_window import stack_windows
from reward_model.fast.relational_kernels import score_by_relation
from reward_model.fast.relational_weights import flat_layers
from tests.reward_model.networks.test_factorised_mpnn import random_network
from tests.reward_model.random_scenes import random_windows

NETWORK = flat_layers(random_network((42, 8, 6, 2), "tabulated").operators())


def scores_by(scoring, windows) -> np.ndarray:
    for window in windows:
        scoring.add(window)
    return np.array(list(scoring.scores()), dtype=np.float32)


def expected(windows) -> np.ndarray:
    scores = np.empty((len(windows), 2), dtype=np.float32)
    for index, window in enumerate(windows):
        score_by_relation(stack_windows([window]), scores[index : index + 1], NETWORK)
    return scores


@pytest.mark.parametrize("num_threads", [1, 3])
@pytest.mark.parametrize("count", [1, 3, 4, 11, 40])
def test_scores_come_in_the_order_of_their_windows(count, num_threads):
    windows = random_windows(41, count)
    with ThreadPoolExecutor(num_threads) as threads:
        for _ in range(3):
            scoring = ScoringAhead(NETWORK, count, 4, threads, num_threads)
            np.testing.assert_array_equal(scores_by(scoring, windows), expected(windows))


def test_threads_score_before_the_last_window_has_come():
    windows = random_windows(42, count=5)
    with ThreadPoolExecutor(1) as threads:
        scoring = ScoringAhead(NETWORK, 5, 2, threads, 1)
        for window in windows[:4]:
            scoring.add(window)
        deadline = time.monotonic() + 10
        while not scoring._board.flags[2:4].all() and time.monotonic() < deadline:
            time.sleep(0.001)
        assert scoring._board.flags.tolist() == [2, 2, 1, 1, 0]
        np.testing.assert_array_equal(scores_by(scoring, windows[4:]), expected(windows))


def test_what_no_thread_has_begun_with_is_done_at_once():
    windows, free = random_windows(43, count=5), Event()
    with ThreadPoolExecutor(1) as threads:
        threads.submit(free.wait)
        np.testing.assert_array_equal(scores_by(ScoringAhead(NETWORK, 5, 2, threads, 1), windows), expected(windows))
        free.set()


def test_a_thread_leaves_when_nothing_comes():
    windows = random_windows(44, count=3)
    with ThreadPoolExecutor(1) as threads:
        scoring = ScoringAhead(NETWORK, 3, 1, threads, 1)
        scoring.add(windows[0])
        scoring._others[0].result(timeout=30)
        np.testing.assert_array_equal(scores_by(scoring, windows[1:]), expected(windows))


def test_an_error_in_a_thread_reaches_who_asks_for_the_scores(monkeypatch):
    def fail(scoring):
        while ahead._take(scoring._board) < 0:
            time.sleep(0.001)
        raise MemoryError("no room")

    monkeypatch.setattr(ScoringAhead, "_score_posted", fail)
    with ThreadPoolExecutor(1) as threads:
        scoring = ScoringAhead(NETWORK, 2, 1, threads, 1)
        scoring.add(random_windows(45, count=1)[0])
        with pytest.raises(MemoryError, match="no room"):
            scoring._others[0].result(timeout=30)
        scoring.add(random_windows(45, count=1)[0])
        with pytest.raises(MemoryError, match="no room"):
            list(scoring.scores())


def test_who_gives_up_takes_nothing_away_from_the_threads(monkeypatch):
    read = []
    score_posted = ScoringAhead._score_posted

    def late(scoring):
        time.sleep(0.2)
        score_posted(scoring)
        read.append(scoring._board.scores[:2].copy())

    monkeypatch.setattr(ScoringAhead, "_score_posted", late)
    windows = random_windows(47, count=2)
    with ThreadPoolExecutor(1) as threads:
        scoring = ScoringAhead(NETWORK, 3, 1, threads, 1)
        for window in windows:
            scoring.add(window)
        stack = weakref.ref(scoring._stacks[0].words)
        del scoring
        assert stack() is not None
    np.testing.assert_array_equal(read[0], expected(windows))


def test_the_number_of_windows_must_be_the_one_announced():
    window = random_windows(46, count=1)[0]
    with ThreadPoolExecutor(1) as threads:
        scoring = ScoringAhead(NETWORK, 2, 1, threads, 1)
        scoring.add(window)
        with pytest.raises(ValueError, match="num_windows was 2, got 1"):
            list(scoring.scores())
        scoring.add(window)
        with pytest.raises(ValueError, match="num_windows was 2, got another window"):
            scoring.add(window)
        with pytest.raises(ValueError, match="a window must have 1 to 3 frames, got 0"):
            scoring.add([])
        assert len(list(scoring.scores())) == 2
