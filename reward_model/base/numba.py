"""The project's interface to numba: a typed `njit` for numeric kernels, and calls of C functions in compiled code."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar, cast

import numba
from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


def njit(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Compile a function of numbers and arrays to machine code, once per machine.

    IEEE semantics are kept (no fast-math), so that a seed gives the same bits on every run. The compiled code is
    cached on disk beside the module or, where that is read-only, in the user's cache folder. It releases the GIL.
    Literal numbers in a call are treated like variables; otherwise numba would compile the function, and everything
    that it calls, anew for each of them.
    """
    compiled: Any = numba.njit(cache=True, error_model="numpy", nogil=True)(function)
    template_of = compiled.get_call_template

    def get_call_template(arguments: Any, keywords: Any) -> Any:
        return template_of(tuple(map(types.unliteral, arguments)), keywords)

    compiled.get_call_template = get_call_template
    return cast(Callable[Parameters, Result], compiled)


def machine_code(function: Callable[Parameters, Result], *arguments: Any) -> Callable[Parameters, Result]:
    """Call a function made by `njit`, and return a faster callable for arguments of the same types.

    The function itself looks up the type of every argument at each call, which takes longer than many kernels where
    arguments are tuples of arrays. The returned callable may skip this: it would misread arrays of another type.
    """
    compiled: Any = function
    compiled(*arguments)
    codes = [overload.entry_point for overload in compiled.overloads.values()]
    return codes[0] if len(codes) == 1 else function


def _typed_call(result: Any, arguments: Any) -> tuple[Any, Any]:
    """The signature of an intrinsic, and its code generator: a call of the function at an address."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        address, *given = values
        kinds = [ir.IntType(64) if kind == types.int64 else ir.DoubleType() for kind in signature.args[1:]]
        function = ir.FunctionType(ir.VoidType(), kinds)
        builder.call(builder.inttoptr(address, function.as_pointer()), given)
        return context.get_dummy_value()

    return result(types.int64, *arguments), generate


def _call_with_pointers(_context: Any, address: Any, first: Any, second: Any, third: Any) -> tuple[Any, Any]:
    return _typed_call(types.void, (types.int64,) * 3)


def _call_with_real(_context: Any, address: Any, pointer: Any, number: Any) -> tuple[Any, Any]:
    return _typed_call(types.void, (types.int64, types.float64))


call_with_pointers = cast(Callable[[int, int, int, int], None], intrinsic(_call_with_pointers))
"""Call the C function at an address, `void (*)(void *, void *, void *)`, in compiled code. Addresses are int64."""

call_with_real = cast(Callable[[int, int, float], None], intrinsic(_call_with_real))
"""Call the C function at an address, `void (*)(void *, double)`, in compiled code."""
