"""Windows that are scored by other threads while more of them come.

The threads stay in compiled code until all is done: had they to come back to Python for every few windows, they and
the thread that brings them would wait for each other's hold on the interpreter, which takes as long as the scoring.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from typing import Final, NamedTuple

import numpy as np

from reward_model.base.arrays import Float32Array, IntArray
from reward_model.base.numba import njit
from reward_model.fast.atomics import let_others_run, load, replace, store, words_at
from reward_model.fast.grouped_window import Stack, stack_windows
from reward_model.fast.relational_kernels import FlatNetwork, score_windows
from reward_model.fast.scoring import Window, check_window

_POSTED, _TAKEN, _FIRST_DONE = range(3)  # places in a board's flags
_GLANCES: Final = 64  # at the board between two offers of the core to others
_PATIENCE: Final = 1 << 20  # glances that find nothing, some 40 ms: then a thread leaves


class _Board(NamedTuple):
    """What the threads share: groups of windows are posted, then taken by one of them, then done.

    flags: (2 + num_groups,) how many groups are posted and how many taken, in their order; 1 for each that is done
    stacks: (num_groups, 2) where a group's words are, and how many
    sizes: (num_windows,) how many frames each window has
    scores: (num_windows, 2) of those that are done
    group_size: windows in each group, the last one excepted
    """

    flags: IntArray
    stacks: IntArray
    sizes: IntArray
    scores: Float32Array
    group_size: int


class ScoringAhead:
    """A `Scoring` whose groups of windows are scored as soon as they are complete; the last may be smaller.

    network: which scores
    num_windows: how many there will be
    threads, num_threads: where that happens, and by how many; what none of them has begun with when scores are asked
        for is scored there and then
    """

    def __init__(
        self,
        network: FlatNetwork,
        num_windows: int,
        group_size: int,
        threads: Executor,
        num_threads: int,
    ) -> None:
        num_groups = -(-num_windows // group_size)
        self._network = network
        self._board = _Board(
            np.zeros(_FIRST_DONE + num_groups, dtype=np.int64),
            np.empty((num_groups, 2), dtype=np.int64),
            np.empty(num_windows, dtype=np.int64),
            np.empty((num_windows, 2), dtype=np.float32),
            group_size,
        )
        self._num_windows = 0
        self._group: list[Window] = []
        self._stacks: list[Stack] = []
        self._others = [threads.submit(self._score_posted) for _ in range(num_threads)]

    def add(self, window: Window) -> None:
        """Take one more window. Raises `ValueError` as `check_window`, and for one too many."""
        check_window(window)
        if self._num_windows == len(self._board.sizes):
            raise ValueError(f"num_windows was {self._num_windows}, got another window")
        self._num_windows += 1
        self._group.append(window)
        if len(self._group) == self._board.group_size or self._num_windows == len(self._board.sizes):
            self._stacks.append(stack_windows(self._group))
            _post(self._board, len(self._stacks) - 1, self._stacks[-1])
            self._group = []

    def scores(self) -> Iterator[tuple[float, float]]:
        """Give q1 and q2 of each window. Raises `ValueError` where windows are missing."""
        size, expected = self._board.group_size, len(self._board.sizes)
        if self._num_windows < expected:
            raise ValueError(f"num_windows was {expected}, got {self._num_windows}")
        for group in range(len(self._stacks)):
            self._finish(group)
            yield from self._board.scores[group * size : (group + 1) * size].tolist()

    def _score_posted(self) -> None:
        """What other threads do; they hold on to this object, and so to the stacks that they read."""
        _score_until(self._board, _TAKEN, len(self._board.stacks), self._network)

    def _finish(self, group: int) -> None:
        while not _score_until(self._board, _FIRST_DONE + group, 1, self._network):
            for other in self._others:
                if other.done():
                    other.result()  # which raises what went wrong in it


@njit
def _post(board: _Board, group: int, stack: Stack) -> None:
    """Post the next group."""
    board.stacks[group, 0], board.stacks[group, 1] = stack.words.ctypes.data, len(stack.words)
    first = group * board.group_size
    board.sizes[first : first + len(stack.sizes)] = stack.sizes
    store(board.flags, _POSTED, group + 1)


@njit
def _score_until(board: _Board, place: int, value: int, network: FlatNetwork) -> bool:
    """Score what is posted until a flag has reached a value, or nothing has come for long; return whether it has.

    One function for all who score: each would take as long to compile as the network.
    """
    idle = 0
    while load(board.flags, place) < value:
        group = _take(board)
        if group >= 0:
            first = group * board.group_size
            last = min(first + board.group_size, len(board.sizes))
            words = words_at(board.stacks[group, 0], board.stacks[group, 1])
            score_windows(Stack(words, board.sizes[first:last]), board.scores[first:last], network)
            store(board.flags, _FIRST_DONE + group, 1)
            idle = 0
            continue
        idle += 1
        if idle % _GLANCES == 0:
            let_others_run()
        if idle == _PATIENCE:
            return False
    return True


@njit
def _take(board: _Board) -> int:
    """The next group that is posted and that nobody else takes, -1 if there is none."""
    while True:
        group = load(board.flags, _TAKEN)
        if group >= load(board.flags, _POSTED):
            return -1
        if replace(board.flags, _TAKEN, group, group + 1):
            return group
