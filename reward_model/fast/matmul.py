"""Small matrix products at the speed of a processor's vector units, for compiled code.

numba does not vectorise a product of three loops, or loads every sum from memory at each step; BLAS is fast, but has
threads of its own and an order of summation that depends on the number of rows. Here a tile of the result stays in
registers during the loop over the inner dimension. Every element is summed in that order, with one rounding for each
product (a fused multiply-add of IEEE 754), so it depends on its row and its column alone, on every processor.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, NamedTuple, cast

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from reward_model.base.arrays import Float32Array
from reward_model.base.numba import njit

LANES: Final = 8  # numbers in a vector: the widths of matrices are multiples of it

# Heights of tiles by their width in vectors, the tallest first: as many as 16 registers hold beside the factors.
_HEIGHTS: Final = {1: (8, 4, 2, 1), 2: (6, 5, 4, 3, 2, 1), 3: (4, 3, 2, 1)}

_BYTE: Final = ir.IntType(8)
_OFFSET: Final = ir.IntType(64)
_NUMBER: Final = ir.FloatType()
_VECTOR: Final = ir.VectorType(_NUMBER, LANES)
_NUMBER_SIZE: Final = 4  # bytes, and how vectors are aligned
_COPIES: Final = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)

_AddColumns = Callable[[Float32Array, int, int, Float32Array, int, Float32Array, int, int, int, int], None]
_AddFlatColumns = Callable[[Float32Array, int, int, Float32Array, int, Float32Array, int, int, int, int, int], None]
_PutFlatColumns = Callable[
    [Float32Array, int, int, Float32Array, int, Float32Array, int, Float32Array, int, int, int, int, int, np.float32],
    None,
]


class _Matrix:
    """A numba array of two dimensions in generated code."""

    def __init__(self, builder: Any, array: Any) -> None:
        self._builder = builder
        self._start = builder.bitcast(array.data, _BYTE.as_pointer())
        self._strides = [builder.extract_value(array.strides, axis) for axis in range(2)]

    def place(self, row: Any, column: Any, kind: Any) -> Any:
        """The address of an element, as a pointer to a number or to a vector."""
        multiply, add = self._builder.mul, self._builder.add
        offset = add(multiply(row, self._strides[0]), multiply(column, self._strides[1]))
        return self._builder.bitcast(self._builder.gep(self._start, [offset]), kind.as_pointer())


class _FlatMatrix:
    """Rows in a numba array of one dimension: the first number's place, and the numbers from one row to the next."""

    def __init__(self, builder: Any, array: Any, start: Any, stride: Any) -> None:
        self._builder, self._stride = builder, stride
        self._start = builder.gep(builder.bitcast(array.data, _NUMBER.as_pointer()), [start])

    def place(self, row: Any, column: Any, kind: Any) -> Any:
        """The address of an element, as a pointer to a number or to a vector."""
        offset = self._builder.add(self._builder.mul(row, self._stride), column)
        return self._builder.bitcast(self._builder.gep(self._start, [offset]), kind.as_pointer())


class _Product(NamedTuple):
    """The operands of a product in generated code; see `add_product`.

    Where there is an `initial` row, every row begins as that instead of as it was; where there is a `least` number, no
    element ends below it.
    """

    left: _Matrix | _FlatMatrix
    left_row: Any
    left_column: Any
    right: _Matrix | _FlatMatrix
    right_row: Any
    out: _Matrix | _FlatMatrix
    out_row: Any
    out_column: Any
    rows: Any
    inner: Any
    initial: _FlatMatrix | None = None
    least: Any = None


def _columns_adder(vectors: int) -> _AddColumns:
    """A function for compiled code that adds `vectors` vectors of columns of a product.

    Its arguments are those of `add_product`, with the first column before the number of rows. The rows are covered by
    the tallest tiles as often as they fit, and then by each lower one once at most.
    """

    @intrinsic
    def add_columns(
        _: Any, left: Any, i: Any, j: Any, right: Any, k: Any, out: Any, row: Any, column: Any, rows: Any, inner: Any
    ) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            operands: list[Any] = [
                _Matrix(builder, context.make_array(kind)(context, builder, value)) if place in (0, 3, 5) else value
                for place, (kind, value) in enumerate(zip(signature.args, arguments, strict=True))
            ]
            _add_column_of_tiles(builder, _Product(*operands), vectors)
            return context.get_dummy_value()

        return types.void(left, i, j, right, k, out, row, column, rows, inner), generate

    return cast(_AddColumns, add_columns)


def _flat_columns_adder(vectors: int) -> _AddFlatColumns:
    """As `_columns_adder`, with the arguments of `add_flat_product`, the first column before the number of rows."""

    @intrinsic
    def add_columns(
        _: Any,
        left: Any,
        left_start: Any,
        left_stride: Any,
        right: Any,
        right_start: Any,
        out: Any,
        out_start: Any,
        columns: Any,
        column: Any,
        rows: Any,
        inner: Any,
    ) -> Any:
        kinds = (left, left_start, left_stride, right, right_start, out, out_start, columns, column, rows, inner)

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            left, left_start, left_stride, right, right_start, out, out_start, columns, column, rows, inner = arguments
            arrays = (
                context.make_array(signature.args[place])(context, builder, value)
                for place, value in ((0, left), (3, right), (5, out))
            )
            places = ((left_start, left_stride), (right_start, columns), (out_start, columns))
            factor, other, result = (
                _FlatMatrix(builder, array, *place) for array, place in zip(arrays, places, strict=True)
            )
            none = _OFFSET(0)
            product = _Product(factor, none, none, other, none, result, none, column, rows, inner)
            _add_column_of_tiles(builder, product, vectors)
            return context.get_dummy_value()

        return types.void(*kinds), generate

    return cast(_AddFlatColumns, add_columns)


def _flat_columns_putter(vectors: int) -> _PutFlatColumns:
    """As `_flat_columns_adder`, with the arguments of `put_flat_product`."""

    @intrinsic
    def put_columns(
        _: Any,
        left: Any,
        left_start: Any,
        left_stride: Any,
        right: Any,
        right_start: Any,
        initial: Any,
        initial_start: Any,
        out: Any,
        out_start: Any,
        columns: Any,
        column: Any,
        rows: Any,
        inner: Any,
        least: Any,
    ) -> Any:
        factors = (left, left_start, left_stride, right, right_start, initial, initial_start)
        kinds = (*factors, out, out_start, columns, column, rows, inner, least)

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            def matrix(place: int, start: Any, stride: Any) -> _FlatMatrix:
                array = context.make_array(signature.args[place])(context, builder, arguments[place])
                return _FlatMatrix(builder, array, start, stride)

            _, start, stride, _, right_start, _, first, _, out_start, columns, column, rows, inner, least = arguments
            none = _OFFSET(0)
            product = _Product(
                matrix(0, start, stride),
                none,
                none,
                matrix(3, right_start, columns),
                none,
                matrix(7, out_start, columns),
                none,
                column,
                rows,
                inner,
                matrix(5, first, columns),
                least,
            )
            _add_column_of_tiles(builder, product, vectors)
            return context.get_dummy_value()

        return types.void(*kinds), generate

    return cast(_PutFlatColumns, put_columns)


def _add_column_of_tiles(builder: Any, product: _Product, vectors: int) -> None:
    with builder.goto_entry_block():
        done = builder.alloca(_OFFSET)  # rows
    builder.store(_OFFSET(0), done)

    def add_tile(height: int) -> None:
        _add_tile(builder, product, builder.load(done), height, vectors)
        builder.store(builder.add(builder.load(done), _OFFSET(height)), done)

    tallest, *lower = _HEIGHTS[vectors]
    with cgutils.for_range(builder, builder.sdiv(product.rows, _OFFSET(tallest))):
        add_tile(tallest)
    for height in lower:
        end = builder.add(builder.load(done), _OFFSET(height))
        with builder.if_then(builder.icmp_signed("<=", end, product.rows)):
            add_tile(height)


def _add_tile(builder: Any, product: _Product, first_row: Any, height: int, vectors: int) -> None:
    """Add a tile of a product: `height` rows from `first_row` on, `vectors` vectors wide."""
    left_rows, out_rows = (
        [builder.add(builder.add(start, first_row), _OFFSET(row)) for row in range(height)]
        for start in (product.left_row, product.out_row)
    )
    columns = [builder.add(product.out_column, _OFFSET(LANES * vector)) for vector in range(vectors)]
    places = [product.out.place(row, column, _VECTOR) for row in out_rows for column in columns]
    with builder.goto_entry_block():
        sums = [builder.alloca(_VECTOR) for _ in places]
    first_values = places
    if product.initial is not None:
        first_values = [product.initial.place(_OFFSET(0), column, _VECTOR) for _ in out_rows for column in columns]
    for place, one_sum in zip(first_values, sums, strict=True):
        builder.store(builder.load(place, align=_NUMBER_SIZE), one_sum)
    multiply_add = ir.FunctionType(_VECTOR, [_VECTOR] * 3)
    fused = cgutils.get_or_insert_function(builder.module, multiply_add, f"llvm.fma.v{LANES}f32")  # type: ignore[no-untyped-call]
    with cgutils.for_range(builder, product.inner) as loop:
        right_row, left_column = (builder.add(first, loop.index) for first in (product.right_row, product.left_column))
        factors = [builder.load(product.right.place(right_row, each, _VECTOR), align=_NUMBER_SIZE) for each in columns]
        for index, row in enumerate(left_rows):
            number = builder.load(product.left.place(row, left_column, _NUMBER))
            vector = _copies(builder, number)
            for one_sum, factor in zip(sums[index * vectors : (index + 1) * vectors], factors, strict=True):
                builder.store(builder.call(fused, [vector, factor, builder.load(one_sum)]), one_sum)
    least = None if product.least is None else _copies(builder, product.least)
    for place, one_sum in zip(places, sums, strict=True):
        value = builder.load(one_sum)
        if least is not None:
            value = builder.select(builder.fcmp_ordered(">", value, least), value, least)
        builder.store(value, place, align=_NUMBER_SIZE)


def _copies(builder: Any, number: Any) -> Any:
    """A vector of copies of a number."""
    vector = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), number, ir.IntType(32)(0))
    return builder.shuffle_vector(vector, ir.Constant(_VECTOR, ir.Undefined), _COPIES)


add_one_vector, _add_two_vectors, _add_three_vectors = _columns_adder(1), _columns_adder(2), _columns_adder(3)


@njit
def add_product(
    left: Float32Array,
    left_row: int,
    left_column: int,
    right: Float32Array,
    right_row: int,
    out: Float32Array,
    out_row: int,
    rows: int,
    inner: int,
) -> None:
    """Add the product of parts of two matrices to a part of a third; views would take time, so arrays are whole.

    The parts are `rows` by `inner` elements of `left`, from a row and a column on, `inner` rows of `right` and `rows`
    rows of `out`, with all columns of `out`. Their number is a multiple of `LANES`; `right` may have more. Rows of
    `right` and `out` are contiguous.
    """
    columns, column = out.shape[1], 0
    while columns - column > 4 * LANES or columns - column == 3 * LANES:
        _add_three_vectors(left, left_row, left_column, right, right_row, out, out_row, column, rows, inner)
        column += 3 * LANES
    while columns - column >= 2 * LANES:
        _add_two_vectors(left, left_row, left_column, right, right_row, out, out_row, column, rows, inner)
        column += 2 * LANES
    if column < columns:
        add_one_vector(left, left_row, left_column, right, right_row, out, out_row, column, rows, inner)


_add_one_flat, _add_two_flat, _add_three_flat = _flat_columns_adder(1), _flat_columns_adder(2), _flat_columns_adder(3)


@njit
def add_flat_product(
    left: Float32Array,
    left_start: int,
    left_stride: int,
    right: Float32Array,
    right_start: int,
    out: Float32Array,
    out_start: int,
    columns: int,
    rows: int,
    inner: int,
) -> None:
    """Add the product of two matrices to a third, all of them parts of arrays of one dimension.

    `rows` by `inner` numbers of `left`, a row `left_stride` numbers after the last; `inner` rows of `right` and `rows`
    rows of `out`, both of `columns` numbers, a multiple of `LANES`. Each part begins at its start.
    """
    column = 0
    while columns - column > 4 * LANES or columns - column == 3 * LANES:
        _add_three_flat(left, left_start, left_stride, right, right_start, out, out_start, columns, column, rows, inner)
        column += 3 * LANES
    while columns - column >= 2 * LANES:
        _add_two_flat(left, left_start, left_stride, right, right_start, out, out_start, columns, column, rows, inner)
        column += 2 * LANES
    if column < columns:
        _add_one_flat(left, left_start, left_stride, right, right_start, out, out_start, columns, column, rows, inner)


_put_one, _put_two, _put_three = _flat_columns_putter(1), _flat_columns_putter(2), _flat_columns_putter(3)


@njit
def put_flat_product(
    left: Float32Array,
    left_start: int,
    left_stride: int,
    right: Float32Array,
    right_start: int,
    initial: Float32Array,
    start: int,
    out: Float32Array,
    out_start: int,
    columns: int,
    rows: int,
    inner: int,
    least: np.float32,
) -> None:
    """As `add_flat_product`, with every row of `out` written anew: the row of `initial` at `start` plus the product.

    Elements below `least` are written as that.
    """
    a, s, t, b, u, i, o, v, n = left, left_start, left_stride, right, right_start, initial, out, out_start, columns
    column = 0
    while columns - column > 4 * LANES or columns - column == 3 * LANES:
        _put_three(a, s, t, b, u, i, start, o, v, n, column, rows, inner, least)
        column += 3 * LANES
    while columns - column >= 2 * LANES:
        _put_two(a, s, t, b, u, i, start, o, v, n, column, rows, inner, least)
        column += 2 * LANES
    if column < columns:
        _put_one(a, s, t, b, u, i, start, o, v, n, column, rows, inner, least)
