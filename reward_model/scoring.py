"""Windows that are scored a few at a time, by other threads, while more of them come."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from collections.abc import Sequence as Items
from concurrent.futures import Executor, Future
from functools import partial

from reward_model.frame_graph import FrameGraph
from reward_model.graph import NUM_FRAMES
from reward_model.packed_frames import Float32Array

Window = Items[FrameGraph]
Task = Callable[[], Float32Array]


class Scoring:
    """Takes windows one by one, and then gives their scores in the same order.

    prepare: makes windows ready and returns what scores them, (num_windows, 2) q1 and q2; the more of it is left to
        that, the more is done elsewhere, if it can be done without Python's lock
    threads: where a group of `group_size` windows is scored once it is complete; what no thread has begun with when
        its scores are asked for is scored there and then. None: all windows are scored together when that happens
    """

    def __init__(
        self, prepare: Callable[[Items[Window]], Task], threads: Executor | None = None, group_size: int = 1
    ) -> None:
        self._prepare = prepare
        self._threads = threads
        self._group_size = group_size
        self._groups: list[tuple[Task, Future[Float32Array]]] = []
        self._rest: list[Window] = []

    def add(self, window: Window) -> None:
        """Take one more window. Raises `ValueError` as `check_window`."""
        check_window(window)
        self._rest.append(window)
        if self._threads is not None and len(self._rest) == self._group_size:
            task = self._prepare(self._rest)
            self._groups.append((task, self._threads.submit(task)))
            self._rest = []

    def scores(self) -> Iterator[tuple[float, float]]:
        """Give q1 and q2 of each window, waiting where need be. To be called once, after the last window."""
        for task, future in self._groups:
            yield from _scores_of(task if future.cancel() else future.result)
        if self._rest:
            yield from _scores_of(self._prepare(self._rest))


def scoring_together(score: Callable[[Items[Window]], Float32Array]) -> Scoring:
    """Return what scores all its windows in one call. score: returns (num_windows, 2) q1 and q2 of windows."""
    return Scoring(lambda windows: partial(score, windows))


def _scores_of(task: Task) -> list[tuple[float, float]]:
    scores: list[tuple[float, float]] = task().tolist()
    return scores


def check_window(window: Window, name: str = "a window") -> None:
    """Raise `ValueError` for a window of another number of frames than one to three. name: what errors call it."""
    if not 1 <= len(window) <= NUM_FRAMES:
        raise ValueError(f"{name} must have 1 to {NUM_FRAMES} frames, got {len(window)}")
