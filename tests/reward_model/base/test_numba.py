from typing import NamedTuple

import numpy as np

from reward_model.base.numba import machine_code, njit


class Pair(NamedTuple):
    values: np.ndarray
    factors: np.ndarray


@njit
def weighted(pair: Pair, times: int) -> float:
    return times * np.sum(pair.values * pair.factors)


def test_machine_code_gives_what_the_function_gives_whatever_types_it_has_met():
    pair = Pair(np.array([1.0, 2.0]), np.array([3.0, 4.0]))
    whole = Pair(np.array([1, 2]), np.array([3, 4]))
    for arguments in ((pair, 2), (whole, 3), (pair, 1)):
        assert machine_code(weighted, *arguments)(*arguments) == weighted(*arguments) == 11 * arguments[1]


@njit
def _plus(number: int, other: int) -> int:
    return number + other


@njit
def _sum_of_sums(number: int) -> int:
    return _plus(1, 2) + _plus(3, number) + _plus(number, 4)


def test_numbers_written_out_need_no_code_of_their_own():
    assert _sum_of_sums(10) == 30
    assert _plus(5, 6) == 11
    assert len(_plus.overloads) == 1
