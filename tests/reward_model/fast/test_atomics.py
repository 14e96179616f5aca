from concurrent.futures import ThreadPoolExecutor

import numpy as np

from reward_model.base.arrays import Int32Array, IntArray
from reward_model.base.numba import njit
from reward_model.fast.atomics import load, replace, store, words_at


@njit
def _count_up(numbers: IntArray, times: int) -> None:
    for _ in range(times):
        while True:
            number = load(numbers, 1)
            if replace(numbers, 1, number, number + 1):
                break


@njit
def _exchange(numbers: IntArray) -> tuple[int, int, int]:
    store(numbers, 0, 7)
    return replace(numbers, 0, 6, 8), replace(numbers, 0, 7, 9), load(numbers, 0)


@njit
def _sum_at(words: Int32Array) -> int:
    total: int = words_at(words.ctypes.data, len(words)).sum()
    return total


def test_a_number_is_replaced_only_where_it_is_the_expected_one():
    numbers = np.zeros(2, dtype=np.int64)
    assert _exchange(numbers) == (0, 1, 9)
    assert numbers.tolist() == [9, 0]


def test_no_thread_loses_a_count():
    numbers = np.zeros(3, dtype=np.int64)
    with ThreadPoolExecutor(4) as threads:
        for each in [threads.submit(_count_up, numbers, 200_000) for _ in range(4)]:
            each.result()
    assert numbers.tolist() == [0, 800_000, 0]


def test_words_are_found_by_their_address():
    assert _sum_at(np.arange(10, dtype=np.int32)) == 45
