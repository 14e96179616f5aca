"""ELU in compiled code, the fused networks' only function that is not a sum or a product."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from reward_model.base.arrays import Float32Array
from reward_model.base.numba import njit

_LOWEST: Final = np.float32(-16.0)  # below it exp is nothing beside 1
_DOUBLINGS: Final = 6
_SCALE: Final = np.float32(1 / 2**_DOUBLINGS)
_TAYLOR: Final = tuple(np.float32(1 / math.factorial(power)) for power in range(1, 8))  # of expm1
_TWO: Final = np.float32(2.0)


@njit
def apply_elu(hidden: Float32Array) -> None:
    """ELU, exp(x) - 1 below 0, by its Taylor series near 0 and exp(2x) - 1 = (exp(x) - 1) (exp(x) - 1 + 2).

    Without a call in it, the loop handles several numbers at once; the library's expm1 takes a third of all time.
    """
    flat = hidden.reshape(-1)
    for place in range(len(flat)):
        value = flat[place]
        low = np.float32(0) if value > 0 else value
        low = _LOWEST if low < _LOWEST else low
        x = low * _SCALE
        y = x * (_TAYLOR[3] + x * (_TAYLOR[4] + x * (_TAYLOR[5] + x * _TAYLOR[6])))
        y = x * (_TAYLOR[0] + x * (_TAYLOR[1] + x * (_TAYLOR[2] + y)))
        for _ in range(_DOUBLINGS):
            y = y * (y + _TWO)
        flat[place] = value if value > 0 else y
