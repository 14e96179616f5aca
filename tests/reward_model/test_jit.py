from typing import NamedTuple

import numpy as np

from reward_model.jit import chosen_by_type, machine_code, njit


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


class Doubling(NamedTuple):
    by: int


class Halving(NamedTuple):
    by: int


@njit
def _double(first: int, second: int, last: Doubling) -> int:
    return 2 * (first + second) + last.by


@njit
def _halve(first: int, second: int, last: Halving) -> int:
    return (first + second) // 2 + last.by


_scaled = chosen_by_type({Doubling: _double, Halving: _halve})


@njit
def _scaled_by(last: Doubling | Halving) -> int:
    return _scaled(3, 5, last) + 100


def test_the_type_of_the_last_argument_chooses_the_function():
    for scaled, plus in ((_scaled_by, 100), (lambda last: _scaled(3, 5, last), 0)):
        assert scaled(Doubling(1)) == 17 + plus
        assert scaled(Halving(2)) == 6 + plus
