"""Progress bars for whoever watches: on stderr, and only where that is a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TypeVar

from rich.console import Console
from rich.progress import Progress, track

Item = TypeVar("Item")


def progress_bars(kept: bool = False) -> Progress:
    """Return bars that are to be added. kept: whether they stay when all is done."""
    console = Console(stderr=True)
    return Progress(console=console, transient=not kept, disable=not console.is_terminal)


def watched(items: Sequence[Item], what: str, least: int = 0) -> Iterable[Item]:
    """Return the same items, with a bar that says what is done to them, where there are at least so many."""
    console = Console(stderr=True)
    return track(items, what, console=console, transient=True, disable=not console.is_terminal or len(items) < least)
