"""The one door to numba: a typed `njit` for the project's numeric kernels."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar

import numba

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


def njit(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Compile a function of numbers and arrays to machine code, once per machine.

    IEEE semantics are kept (no fast-math), so that a seed gives the same bits on every run; the compiled
    code is cached on disk beside the module or, where that is read-only, in the user's cache folder. It lets other
    threads run meanwhile.
    """
    compiled: Callable[Parameters, Result] = numba.njit(cache=True, error_model="numpy", nogil=True)(function)
    return compiled
