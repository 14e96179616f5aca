"""Windows that come one by one, and the scores that are asked for when all are there."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Protocol

from reward_model.base.arrays import Float32Array
from reward_model.graph.frame import FrameGraph
from reward_model.graph.windows import NUM_FRAMES

Window = Sequence[FrameGraph]


class Scoring(Protocol):
    """Takes windows one by one, and then gives their scores in the same order."""

    def add(self, window: Window) -> None:
        """Take one more window. Raises `ValueError` as `check_window`."""

    def scores(self) -> Iterator[tuple[float, float]]:
        """Give q1 and q2 of each window. To be called once, after the last one."""


class ScoringTogether:
    """Scores all its windows in one call.

    score: returns (num_windows, 2) q1 and q2 of windows
    """

    def __init__(self, score: Callable[[Sequence[Window]], Float32Array]) -> None:
        self._score = score
        self._windows: list[Window] = []

    def add(self, window: Window) -> None:
        """Take one more window. Raises `ValueError` as `check_window`."""
        check_window(window)
        self._windows.append(window)

    def scores(self) -> Iterator[tuple[float, float]]:
        """Give q1 and q2 of each window. To be called once, after the last one."""
        if self._windows:
            yield from self._score(self._windows).tolist()


def check_window(window: Window, name: str = "a window") -> None:
    """Raise `ValueError` for a window of another number of frames than one to three. name: what errors call it."""
    if not 1 <= len(window) <= NUM_FRAMES:
        raise ValueError(f"{name} must have 1 to {NUM_FRAMES} frames, got {len(window)}")
