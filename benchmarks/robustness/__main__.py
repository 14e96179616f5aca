"""Properties of a reward model's scores on odd scenes: `python -m benchmarks.robustness`.

The scenes range from ordinary to far beyond sense, and the reader accepts all of them: moments of simulated rooms
(room), the same with the robot next to, on or in a person, an object or a wall (contact), rooms of 10 km, heaps of 200
people, speeds of a million metres a second (extreme), and numbers at the limits of floating point (limits). They take
turns, so each kind is a quarter.

Each line of the table is a property on one kind of scene, with the number of scenes that fail and the worst value;
where scenes fail, the worst one is described below. Contact is computed from the newest snapshot with the simulator's
radius of 0.25 m for the robot and for people, rotated rectangles for objects, and segments for walls.

--range measures the mark of windows that are out of the range of the rated scenes instead: of as many windows inside
(rooms of 4 to 18 m, up to 28 people, the goal within 10 m, a robot of at most 0.37 m/s), and of as many in each case
that differs from those by one fact.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from rich.console import Console
from rich.table import Table

from benchmarks.robustness.properties import PROPERTIES, Survey
from benchmarks.robustness.rated_range import Marks, marks
from benchmarks.robustness.scenes import KINDS, described, kind_of, odd_scene
from reward_model.base.commands import check_least, run_command
from reward_model.base.progress import watched
from reward_model.scenes.scene import SceneSequence
from reward_model.scenes.socnav2_json import write_socnav2
from reward_model.scorer import load_scorer

_TOGETHER = 64  # ordinary scenes in a batch


@dataclass(frozen=True)
class Robustness:
    """The network and the scenes."""

    weights: str = "default"
    """default (what ships), published (after import-published) or a checkpoint folder."""
    scenes: int = 10_000
    """Number of scenes of all kinds; with --range of each case."""
    seed: int = 0
    """Seed of the scenes."""
    range: bool = False
    """Measure the mark of windows out of the rated range instead."""
    output: Path | None = None
    """A folder for the worst scene of each failing line, as SocNav2 files."""

    def run(self) -> None:
        """Score, check and print."""
        check_least(self, scenes=1, seed=0)
        scorer = load_scorer(self.weights)
        torch.set_num_threads(1)
        console = Console()
        if self.range:
            console.print(_marks_table(marks(scorer, self.scenes, self.seed)))
            return
        survey = Survey(scorer)
        waiting: dict[str, list[SceneSequence]] = {kind: [] for kind in KINDS}
        for index in watched(range(self.scenes), "scoring"):
            group = waiting[kind_of(index)]
            group.append(odd_scene(self.seed, index))
            if len(group) == _TOGETHER:
                survey.check(kind_of(index), group)
                group.clear()
        for kind, group in waiting.items():
            survey.check(kind, group)
        print_survey(console, survey, f"{self.weights}: {self.scenes} scenes of seed {self.seed}")
        if self.output is not None:
            write_worst(survey, self.output)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    return run_command("python -m benchmarks.robustness", Robustness, arguments, __doc__)


def print_survey(console: Console, survey: Survey, title: str) -> None:
    """Print the table, the worst scene of each line that fails, and a verdict for each property."""
    table = Table(title=title)
    for heading in ("property", "scenes", "checked", "refused", "failed", "worst", "scene"):
        table.add_column(heading, justify="left" if heading in ("property", "scenes") else "right")
    failures = []
    for name in PROPERTIES:
        for kind in KINDS:
            if (tally := survey.tallies.get((name, kind))) is None or tally.scene is None:
                continue
            refused = str(tally.refused) if tally.refused else ""
            number = tally.scene.name.removeprefix(f"{kind} ")
            table.add_row(name, kind, str(tally.checked), refused, str(tally.failed), f"{tally.worst:.2g}", number)
            if tally.failed:
                problem = tally.problem and f" {tally.problem};"
                failures.append(f"{name}, {tally.scene.name}:{problem} {described(tally.scene)}")
    console.print(table)
    for failure in failures:
        console.print(failure, highlight=False, markup=False, soft_wrap=True)
    for name, rule in PROPERTIES.items():
        of_all_kinds = [tally for (of, _), tally in survey.tallies.items() if of == name]
        failed, checked = sum(each.failed for each in of_all_kinds), sum(each.checked for each in of_all_kinds)
        verdict = f"{'FAIL' if failed else 'PASS'} {name}: {rule} ({failed} of {checked} fail)"
        console.print(verdict, highlight=False, markup=False, soft_wrap=True)


def write_worst(survey: Survey, folder: Path) -> None:
    """Write the worst scene of each line that fails."""
    folder.mkdir(parents=True, exist_ok=True)
    for (name, kind), tally in survey.tallies.items():
        if tally.failed and tally.scene is not None:
            write_socnav2(tally.scene, folder / f"{name.replace(' ', '_')}-{kind}.json")


def _marks_table(found: dict[str, Marks]) -> Table:
    table = Table(title="Windows marked as out of range")
    for heading in ("", "windows", "marked", "share", "reasons, for example"):
        table.add_column(heading, justify="right" if heading in ("windows", "marked", "share") else "left")
    for case, result in found.items():
        share = f"{result.marked / result.windows:.1%}"
        table.add_row(case, str(result.windows), str(result.marked), share, ", ".join(result.example))
    return table


if __name__ == "__main__":
    sys.exit(main())
