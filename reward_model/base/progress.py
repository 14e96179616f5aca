"""Progress bars on stderr, shown only where that is a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TypeVar

from rich.console import Console
from rich.progress import Progress, track

Item = TypeVar("Item")


def progress_bars(kept: bool = False, shown: bool = True) -> Progress:
    """A display without bars yet.

    Args:
        kept: whether bars stay on the screen at the end
        shown: whether bars are shown on a terminal
    """
    console, on_terminal = _console()
    return Progress(console=console, transient=not kept, disable=not (shown and on_terminal))


def watched(items: Sequence[Item], what: str, least: int = 0) -> Iterable[Item]:
    """The same items, with a progress bar labelled `what` where there are at least `least` of them."""
    console, on_terminal = _console()
    hidden = not on_terminal or len(items) < least
    return track(items, what, console=console, transient=True, disable=hidden)


def _console() -> tuple[Console, bool]:
    """stderr, and whether it is a terminal."""
    # Rich before version 15 ends bars with an empty line on a console that is not interactive, even hidden ones.
    console = Console(stderr=True, force_interactive=True)
    return console, console.is_terminal
