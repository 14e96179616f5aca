import numpy as np
import pytest

from reward_model.fast.matmul import LANES, add_flat_product, add_product


def whole_numbers(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Products and sums of small whole numbers are exact in any order."""
    return rng.integers(-9, 10, shape).astype(np.float32)


def product(left: np.ndarray, right: np.ndarray, out: np.ndarray) -> None:
    add_product(left, 0, 0, right, 0, out, 0, len(left), len(right))


@pytest.mark.parametrize("columns", [LANES, 2 * LANES, 3 * LANES, 8 * LANES])
def test_products_are_added(columns):
    rng = np.random.default_rng(columns)
    for rows in range(20):
        left, right, out = (whole_numbers(rng, *shape) for shape in ((rows, 5), (5, columns), (rows, columns)))
        expected = out + left @ right
        product(left, right, out)
        np.testing.assert_array_equal(out, expected)


@pytest.mark.parametrize("rows", range(1, 10))
@pytest.mark.parametrize("columns", [LANES, 2 * LANES])
def test_parts_of_arrays_leave_the_rest_alone(rows, columns):
    rng = np.random.default_rng(rows)
    left, right, out = whole_numbers(rng, 12, 9), whole_numbers(rng, 8, 24), whole_numbers(rng, 14, columns)
    expected = out.copy()
    expected[4 : 4 + rows] += left[2 : 2 + rows, 3:7] @ right[1:5, :columns]
    add_product(left, 2, 3, right, 1, out, 4, rows, 4)
    np.testing.assert_array_equal(out, expected)


@pytest.mark.parametrize("rows", range(1, 10))
@pytest.mark.parametrize("columns", [LANES, 2 * LANES, 3 * LANES, 8 * LANES])
def test_parts_of_flat_arrays_leave_the_rest_alone(rows, columns):
    rng = np.random.default_rng(rows)
    left, right, out = (
        whole_numbers(rng, 150),
        whole_numbers(rng, 7 + 5 * columns),
        whole_numbers(rng, 9 + 12 * columns),
    )
    expected = out.copy()
    factor = np.stack([left[3 + 11 * row : 8 + 11 * row] for row in range(rows)])  # of rows of 11 numbers
    part = expected[9 : 9 + rows * columns].reshape(rows, columns)
    part += factor @ right[7:].reshape(5, columns)
    add_flat_product(left, 3, 11, right, 7, out, 9, columns, rows, 5)
    np.testing.assert_array_equal(out, expected)


def test_the_left_may_be_turned():
    rng = np.random.default_rng(0)
    left, right, out = whole_numbers(rng, 7, 3), whole_numbers(rng, 7, 16), np.zeros((3, 16), dtype=np.float32)
    product(left.T, right, out)
    np.testing.assert_array_equal(out, left.T @ right)


def test_nothing_to_sum_or_to_add_to():
    out = np.full((2, 8), 7, np.float32)
    add_product(np.zeros((2, 0), np.float32), 0, 0, np.zeros((0, 8), np.float32), 0, out, 0, 2, 0)
    add_product(np.zeros((2, 2), np.float32), 2, 0, np.ones((2, 8), np.float32), 0, out, 2, 0, 2)
    assert (out == 7).all()


def test_a_row_is_the_same_to_the_last_bit_among_others_and_alone():
    rng = np.random.default_rng(1)
    left, right = (rng.normal(size=shape).astype(np.float32) for shape in ((23, 100), (100, 40)))
    together = np.zeros((23, 40), np.float32)
    product(left, right, together)
    for row in range(23):
        alone = np.zeros((1, 40), np.float32)
        product(left[row : row + 1], right, alone)
        assert alone.tobytes() == together[row].tobytes()
    in_order = np.zeros(40, np.float32)
    for index in range(100):  # a product of two float32 is exact in float64: one rounding, as of a fused multiply-add
        in_order = (np.float64(left[0, index]) * right[index] + in_order).astype(np.float32)
    assert in_order.tobytes() == together[0].tobytes()
