"""How like real pedestrians the simulated ones walk: `python -m benchmarks.realism --data DIR`.

DIR holds `hotel.txt`, `zara01.txt` and `*_groups.txt` (ETH and UCY, as OpenTraj converts them). One real person at a
time is replaced by a simulated one who knows the start, the velocity over the 0.4 s before, and a final point, and who
walks for 4.8 s among the others, who walk as they did and are strangers to them. Everyone is replaced in every 4.8 s of
their track.

What is known of the future comes in three kinds. The straight walker, which the simulated one is compared with, always
knows the same:

- exit: the place where the person leaves the scene. Straight: there, at the speed of the start, and no further.
- place: where the person is 4.8 s later, but not when they get there. Straight: likewise.
- appointment: that place and the time. Straight: there, at the one speed that arrives just then.

ADE and FDE: distance from where the real person is [m], mean over the 4.8 s and at their end; every 0.4 s.
Collisions: share of walks that come closer than 0.5 m, two bodies, to someone; every 0.05 s.

Then everyone of zara01 is simulated at once, with their companions, from where and when they enter to where they leave:
speeds and distances to the nearest neighbour, every 0.4 s, beside the real ones.

--fit searches the parameters of `PeopleConfig.pedestrians` on hotel.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.stats import ks_2samp

from benchmarks.realism.crowd_replay import (
    KINDS,
    Figures,
    figures_of,
    real_walker,
    social_force_walker,
    straight_walker,
)
from benchmarks.realism.fit import SEARCHED, fit
from benchmarks.realism.simulated_crowd import real_crowd, simulated_crowd
from benchmarks.realism.tracks import Track, Walks, read_groups, read_tracks, walks_of
from reward_model.base.arrays import IntArray
from reward_model.base.commands import run_command
from socnav_env.config import PeopleConfig

FITTED, CHECKED = "hotel", "zara01"
PERCENTILES = (5, 25, 50, 75, 95)


@dataclass(frozen=True)
class Realism:
    """Where the recordings are, and whether to search."""

    data: Path
    """Folder with hotel.txt, zara01.txt and zara01_groups.txt."""
    fit: bool = False
    """Search parameters on hotel instead of showing how the preset does."""
    generations: int = 12
    """Of the search."""
    seed: int = 0
    """Of the search."""

    def run(self) -> None:
        """Search, or show all tables. Raises `TracksError` for a file that cannot be used."""
        console, people = Console(), PeopleConfig.pedestrians()
        recordings = {name: walks_of(read_tracks(self.data / f"{name}.txt")) for name in (FITTED, CHECKED)}
        if self.fit:
            console.print(f"searching on {FITTED}, loss after each generation:")
            people = fit(recordings[FITTED], self.generations, self.seed, lambda loss: console.print(f"{loss:.4f}"))
            for name in SEARCHED:
                console.print(f"{name} = {getattr(people, name):.3g}")
        for name, walks in recordings.items():
            console.print(_errors_table(name, walks, people))
        tracks = read_tracks(self.data / f"{CHECKED}.txt")
        groups = read_groups(self.data / f"{CHECKED}_groups.txt", tracks)
        console.print(_crowd_table(list(tracks.values()), groups, people))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    return run_command("python -m benchmarks.realism", Realism, arguments, __doc__)


def _errors_table(name: str, walks: Walks, people: PeopleConfig) -> Table:
    table = _table(f"{name}: {len(walks.paths)} walks of 4.8 s", ("known", "walker", "ADE", "FDE", "collisions"))
    walkers = {
        "straight": straight_walker,
        "social force, defaults": social_force_walker(PeopleConfig()),
        "social force, pedestrians": social_force_walker(people),
    }
    _add_figures(table, "everything", "real", figures_of(walks, real_walker(walks)))
    for kind in KINDS:
        for walker, path_of in walkers.items():
            _add_figures(table, kind, walker, figures_of(walks, path_of(walks, kind)))
    return table


def _add_figures(table: Table, kind: str, walker: str, figures: Figures) -> None:
    table.add_row(kind, walker, f"{figures.ade:.3f}", f"{figures.fde:.3f}", f"{figures.collisions:.3f}")


def _crowd_table(tracks: list[Track], groups: IntArray, people: PeopleConfig) -> Table:
    headings = ("of everyone", "who", "mean", *(f"{percent} %" for percent in PERCENTILES), "largest gap of the CDFs")
    table = _table(f"{CHECKED}, everyone simulated at once", headings)
    real, simulated = real_crowd(tracks), simulated_crowd(tracks, groups, people)
    for quantity, one, other in (
        ("speed [m/s]", real.speeds, simulated.speeds),
        ("nearest neighbour [m]", real.neighbours, simulated.neighbours),
    ):
        gap = float(ks_2samp(one, other).statistic)
        for who, values, last in (("real", one, ""), ("simulated", other, f"{gap:.2f}")):
            shares = (f"{value:.2f}" for value in np.percentile(values, PERCENTILES))
            table.add_row(quantity, who, f"{values.mean():.2f}", *shares, last)
    return table


def _table(title: str, headings: tuple[str, ...]) -> Table:
    table = Table(title=title)
    for number, heading in enumerate(headings):
        table.add_column(heading, justify="left" if number < 2 else "right")
    return table


if __name__ == "__main__":
    sys.exit(main())
