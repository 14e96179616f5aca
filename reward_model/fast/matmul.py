"""Small matrix products at the speed of a processor's vector units, for compiled code.

numba leaves a product of three loops scalar, or fetches every sum from memory at each step; BLAS is fast, but has
threads of its own and sums in an order that depends on how many rows there are. Here a tile of the result stays in
registers while one loop runs over what is summed. Every element is summed in that order, each product added to it with
one rounding (a fused multiply-add of IEEE 754), so it depends on its row and its column alone, on every processor.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, cast

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from reward_model.base.arrays import Float32Array
from reward_model.base.numba import njit

LANES: Final = 8  # numbers in a vector: the widths of matrices are multiples of it

_BYTE: Final = ir.IntType(8)
_OFFSET: Final = ir.IntType(64)
_NUMBER: Final = ir.FloatType()
_VECTOR: Final = ir.VectorType(_NUMBER, LANES)
_NUMBER_SIZE: Final = 4  # bytes, and how vectors are aligned
_COPIES: Final = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)


_Tile = Callable[[Float32Array, int, int, Float32Array, int, Float32Array, int, int, int], None]


def _tile(rows: int, vectors: int) -> _Tile:
    """A function of compiled code: the part of a product that is so many rows high and so many vectors wide."""

    @intrinsic
    def tile(_: Any, left: Any, i: Any, j: Any, right: Any, k: Any, out: Any, row: Any, column: Any, inner: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            matrices = [
                _Matrix(builder, context.make_array(signature.args[place])(context, builder, arguments[place]))
                for place in (0, 3, 5)
            ]
            numbers = (arguments[1], arguments[2], arguments[4], *arguments[6:])
            _add_tile(builder, matrices, numbers, (rows, vectors))
            return context.get_dummy_value()

        return types.void(left, i, j, right, k, out, row, column, inner), generate

    return cast(_Tile, tile)


class _Matrix:
    """A numba array of two dimensions in code that is being written."""

    def __init__(self, builder: Any, array: Any) -> None:
        self._builder = builder
        self._start = builder.bitcast(array.data, _BYTE.as_pointer())
        self._strides = [builder.extract_value(array.strides, axis) for axis in range(2)]

    def place(self, row: Any, column: Any, kind: Any) -> Any:
        """The address of an element, as that of a number or of a vector."""
        multiply, add = self._builder.mul, self._builder.add
        offset = add(multiply(row, self._strides[0]), multiply(column, self._strides[1]))
        return self._builder.bitcast(self._builder.gep(self._start, [offset]), kind.as_pointer())


def _add_tile(builder: Any, matrices: list[_Matrix], numbers: Any, size: tuple[int, int]) -> None:
    left, right, out = matrices
    left_row, left_column, right_row, out_row, out_column, inner = numbers
    left_rows, out_rows = (
        [builder.add(first, _OFFSET(row)) for row in range(size[0])] for first in (left_row, out_row)
    )
    columns = [builder.add(out_column, _OFFSET(LANES * vector)) for vector in range(size[1])]
    places = [[out.place(row, column, _VECTOR) for column in columns] for row in out_rows]
    with builder.goto_entry_block():
        sums = [[builder.alloca(_VECTOR) for _ in columns] for _ in out_rows]
    for row_places, row_sums in zip(places, sums, strict=True):
        for place, one_sum in zip(row_places, row_sums, strict=True):
            builder.store(builder.load(place, align=_NUMBER_SIZE), one_sum)
    multiply_add = ir.FunctionType(_VECTOR, [_VECTOR] * 3)
    fused = cgutils.get_or_insert_function(builder.module, multiply_add, f"llvm.fma.v{LANES}f32")  # type: ignore[no-untyped-call]
    with cgutils.for_range(builder, inner) as loop:
        right_place, left_place = (builder.add(first, loop.index) for first in (right_row, left_column))
        factors = [builder.load(right.place(right_place, column, _VECTOR), align=_NUMBER_SIZE) for column in columns]
        for row, row_sums in zip(left_rows, sums, strict=True):
            number = builder.load(left.place(row, left_place, _NUMBER))
            vector = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), number, ir.IntType(32)(0))
            vector = builder.shuffle_vector(vector, ir.Constant(_VECTOR, ir.Undefined), _COPIES)
            for one_sum, factor in zip(row_sums, factors, strict=True):
                builder.store(builder.call(fused, [vector, factor, builder.load(one_sum)]), one_sum)
    for row_places, row_sums in zip(places, sums, strict=True):
        for place, one_sum in zip(row_places, row_sums, strict=True):
            builder.store(builder.load(one_sum), place, align=_NUMBER_SIZE)


# Rows and vectors of columns of each tile: as many as 16 registers hold beside what they are made of.
_tile_6_2, _tile_5_2, _tile_4_2 = _tile(6, 2), _tile(5, 2), _tile(4, 2)
_tile_3_2, _tile_2_2, _tile_1_2 = _tile(3, 2), _tile(2, 2), _tile(1, 2)
_tile_4_3, _tile_3_3, _tile_2_3, _tile_1_3 = _tile(4, 3), _tile(3, 3), _tile(2, 3), _tile(1, 3)
_tile_8_1, _tile_4_1, tile_2_1, tile_1_1 = _tile(8, 1), _tile(4, 1), _tile(2, 1), _tile(1, 1)


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
    """Add the product of two matrices' parts to a part of a third, all of them of whole arrays: views take their time.

    The parts are `rows` by `inner` of `left`, from a row and a column on, `inner` rows of `right` and `rows` of `out`,
    all columns of it. That many is a multiple of `LANES`; `right` may have more. In `right` and `out` a row's elements
    stand side by side.
    """
    columns, column = out.shape[1], 0
    while columns - column > 4 * LANES or columns - column == 3 * LANES:
        _add_columns_3(left, left_row, left_column, right, right_row, out, out_row, column, rows, inner)
        column += 3 * LANES
    while columns - column >= 2 * LANES:
        _add_columns_2(left, left_row, left_column, right, right_row, out, out_row, column, rows, inner)
        column += 2 * LANES
    if column < columns:
        _add_columns_1(left, left_row, left_column, right, right_row, out, out_row, column, rows, inner)


@njit
def _add_columns_1(
    left: Float32Array,
    i: int,
    j: int,
    right: Float32Array,
    k: int,
    out: Float32Array,
    row: int,
    column: int,
    rows: int,
    inner: int,
) -> None:
    end = row + rows
    while row + 8 <= end:
        _tile_8_1(left, i, j, right, k, out, row, column, inner)
        i, row = i + 8, row + 8
    if row + 4 <= end:
        _tile_4_1(left, i, j, right, k, out, row, column, inner)
        i, row = i + 4, row + 4
    if row + 2 <= end:
        tile_2_1(left, i, j, right, k, out, row, column, inner)
        i, row = i + 2, row + 2
    if row + 1 <= end:
        tile_1_1(left, i, j, right, k, out, row, column, inner)
        i, row = i + 1, row + 1


@njit
def _add_columns_2(
    left: Float32Array,
    i: int,
    j: int,
    right: Float32Array,
    k: int,
    out: Float32Array,
    row: int,
    column: int,
    rows: int,
    inner: int,
) -> None:
    end = row + rows
    while row + 6 <= end:
        _tile_6_2(left, i, j, right, k, out, row, column, inner)
        i, row = i + 6, row + 6
    if row + 5 == end:
        _tile_5_2(left, i, j, right, k, out, row, column, inner)
    elif row + 4 == end:
        _tile_4_2(left, i, j, right, k, out, row, column, inner)
    elif row + 3 == end:
        _tile_3_2(left, i, j, right, k, out, row, column, inner)
    elif row + 2 == end:
        _tile_2_2(left, i, j, right, k, out, row, column, inner)
    elif row + 1 == end:
        _tile_1_2(left, i, j, right, k, out, row, column, inner)


@njit
def _add_columns_3(
    left: Float32Array,
    i: int,
    j: int,
    right: Float32Array,
    k: int,
    out: Float32Array,
    row: int,
    column: int,
    rows: int,
    inner: int,
) -> None:
    end = row + rows
    while row + 4 <= end:
        _tile_4_3(left, i, j, right, k, out, row, column, inner)
        i, row = i + 4, row + 4
    if row + 3 == end:
        _tile_3_3(left, i, j, right, k, out, row, column, inner)
    elif row + 2 == end:
        _tile_2_3(left, i, j, right, k, out, row, column, inner)
    elif row + 1 == end:
        _tile_1_3(left, i, j, right, k, out, row, column, inner)
