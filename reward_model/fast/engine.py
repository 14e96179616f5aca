"""Scoring of windows by a network in compiled code, within an environment's step.

An MPNN's arithmetic is that of `reward_model.networks.factorised_mpnn` without padding and without a framework between
the products. A few windows pass each layer as a batch, so that its matrices are loaded once for all of them;
`reward_model.fast.matmul` ensures that a window's scores do not depend on the others.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from typing import Any, Final, TypeVar

import numpy as np
import torch

from reward_model.base.arrays import Float32Array
from reward_model.graph.frame import FrameGraph, stack_windows
from reward_model.graph.packing import Stack

_LEAST_SHARE: Final = 4  # windows for which a thread of their own pays

Arrays = TypeVar("Arrays", bound=tuple[Any, ...])


class FusedNetwork:
    """A network turned into flat arrays, ready to score windows on the CPU.

    It uses as many threads as PyTorch is set to. Scores depend on their window alone, to the last bit.

    Args:
        network: a named tuple of arrays
        score_windows: compiled code that writes the scores of windows (num_windows, columns), given that tuple
        columns: 2 for Q1 and Q2, 5 for these, their standard deviations and whether scenes are in range
        together: windows of a batch, whose data should fit into a core's own cache
    """

    def __init__(
        self,
        network: Arrays,
        score_windows: Callable[[Stack, Float32Array, Arrays], None],
        columns: int = 2,
        together: int = 8,
    ) -> None:
        self._columns, self._together = columns, together
        self._network: Any = network
        self._score_windows: Callable[[Stack, Float32Array, Any], None] = score_windows

    def __call__(self, windows: Sequence[Sequence[FrameGraph]]) -> Float32Array:
        """Scores (num_windows, columns) of windows of up to three frames, newest first."""
        scores = np.empty((len(windows), self._columns), dtype=np.float32)
        num_shares = min(torch.get_num_threads(), len(windows) // _LEAST_SHARE)
        if num_shares <= 1:
            self._score(windows, scores)
            return scores
        ends = [len(windows) * share // num_shares for share in range(num_shares + 1)]
        shares = [slice(*pair) for pair in pairwise(ends)]
        threads = _threads(num_shares - 1)
        others = [threads.submit(self._score, windows[share], scores[share]) for share in shares[1:]]
        self._score(windows[shares[0]], scores[shares[0]])
        for other in others:
            other.result()
        return scores

    def _score(self, windows: Sequence[Sequence[FrameGraph]], scores: Float32Array) -> None:
        for start in range(0, len(windows), self._together):
            few = slice(start, start + self._together)
            self._score_windows(stack_windows(windows[few]), scores[few], self._network)


@cache
def _threads(count: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(count, thread_name_prefix="scorer")


os.register_at_fork(after_in_child=_threads.cache_clear)  # a forked process does not have its parent's threads
