"""Progress bars for whoever watches: on stderr, and only where that is a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TypeVar

from rich.console import Console
from rich.progress import Progress, track

Item = TypeVar("Item")


def progress_bars(kept: bool = False, shown: bool = True) -> Progress:
    """Return bars that are to be added.

    kept: whether they stay when all is done
    shown: whether there are any, where somebody watches
    """
    console, watched_by_someone = _console()
    return Progress(console=console, transient=not kept, disable=not (shown and watched_by_someone))


def watched(items: Sequence[Item], what: str, least: int = 0) -> Iterable[Item]:
    """Return the same items, with a bar that says what is done to them, where there are at least so many."""
    console, watched_by_someone = _console()
    hidden = not watched_by_someone or len(items) < least
    return track(items, what, console=console, transient=True, disable=hidden)


def _console() -> tuple[Console, bool]:
    """stderr, and whether it is a terminal."""
    # Rich before version 15 ends bars with an empty line on a console that is not interactive, even hidden ones.
    console = Console(stderr=True, force_interactive=True)
    return console, console.is_terminal
