"""What threads in compiled code share: numbers of int64 arrays that are read and written whole, and arrays by address.

Who loads a number that another thread has stored also sees all that it wrote before (acquire and release of C11).
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any, Final, cast

import numpy as np
from llvmlite import ir
from numba import carray  # type: ignore[attr-defined]  # it is not listed among what numba exports
from numba.core import cgutils, types
from numba.extending import intrinsic

from reward_model.base.arrays import Int32Array, IntArray
from reward_model.base.numba import njit

_ALIGNMENT: Final = 8  # bytes


def _place(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """The address of the number that the first two arguments, an array and an index, stand for."""
    array = context.make_array(signature.args[0])(context, builder, arguments[0])
    return builder.gep(array.data, [arguments[1]])


def _load(_: Any, array: Any, index: Any) -> tuple[Any, Any]:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.load_atomic(_place(context, builder, signature, arguments), "acquire", _ALIGNMENT)

    return types.int64(array, types.int64), generate


def _store(_: Any, array: Any, index: Any, number: Any) -> tuple[Any, Any]:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.store_atomic(arguments[2], _place(context, builder, signature, arguments), "release", _ALIGNMENT)
        return context.get_dummy_value()

    return types.void(array, types.int64, types.int64), generate


def _replace(_: Any, array: Any, index: Any, old: Any, new: Any) -> tuple[Any, Any]:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place = _place(context, builder, signature, arguments)
        found = builder.cmpxchg(place, arguments[2], arguments[3], "acq_rel", "acquire")
        return builder.zext(builder.extract_value(found, 1), ir.IntType(64))

    return types.int64(array, types.int64, types.int64, types.int64), generate


def _pointer(_: Any, address: Any) -> tuple[Any, Any]:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], cgutils.voidptr_t)

    return types.voidptr(types.int64), generate


load = cast(Callable[[IntArray, int], int], intrinsic(_load))
"""In compiled code: the number at an index."""

store = cast(Callable[[IntArray, int, int], None], intrinsic(_store))
"""In compiled code: write a number to an index."""

replace = cast(Callable[[IntArray, int, int, int], int], intrinsic(_replace))
"""In compiled code: write `new` to an index if `old` stands there. Returns 1 if it did, else 0."""

_pointer_to = cast(Callable[[int], Any], intrinsic(_pointer))


@njit
def words_at(address: int, count: int) -> Int32Array:
    """So many int32 at an address, which somebody else keeps alive."""
    words: Int32Array = carray(_pointer_to(address), (count,), np.int32)
    return words


_CAN_YIELD: Final = hasattr(os, "sched_yield")  # POSIX
_sched_yield: Any = types.ExternalFunction("sched_yield", types.int32())


@njit
def let_others_run() -> None:
    """Offer the core to whoever waits for one."""
    if _CAN_YIELD:
        _sched_yield()
