"""The commands of `python -m reward_model`. Each loads what it needs when it runs, so that `--help` is quick."""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

import tyro
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from reward_model.base.commands import Command, Files, run_command
from reward_model.base.progress import progress_bars, watched
from reward_model.commands.learning import Agreement, Evaluate, Train
from reward_model.commands.studies import Experiments, Label, Search

if TYPE_CHECKING:
    from reward_model.graph.frame import FrameGraph
    from reward_model.scenes.scene import Scores


@dataclass(frozen=True)
class Score:
    """Score recorded scenes: one JSON line a file with its Q1 and Q2, 0 (unacceptable) to 1 (perfect).

    A line also has the standard deviations over an ensemble's members, 0 for a single network, and whether the scene is
    in the range of the network's training data, with what is not: "room of 30 m".

    All files are read before the first line is printed. Where one of them is no valid scene, nothing is scored:
    a line on stderr names each bad file, and the exit status is 2.
    """

    files: Files
    """SocNav2 JSON files."""
    weights: str = "default"
    """default (what ships), published (after import-published) or a checkpoint folder."""
    form: Literal["auto", "compiled", "dgl"] = "auto"
    """compiled is fast and needs no DGL; dgl runs the network as it is defined; auto takes what there is."""
    time_scale: float = 1.0
    """Score the scenes played this many times slower, for robots that are faster than those that people rated."""

    def run(self) -> None:
        """Read every file, then score them together; see the class."""
        if not self.files:
            raise ValueError("score needs at least one file")
        from reward_model.scenes.time_scale import check_factor
        from reward_model.scorer import load_scorer, weights_path

        check_factor(self.time_scale)
        weights_path(self.weights)  # where there are none, say so before reading what may be many files
        windows = _read_windows(self.files, self.time_scale)
        scorer = load_scorer(self.weights, self.form)
        scores = scorer.assess_windows(windows).rows()
        print("\n".join(_score_lines(self.files, scores, scorer.out_of_range(windows))), flush=True)


@dataclass(frozen=True)
class ImportPublished:
    """Store the network published by Bachiller et al. in the user's cache, for the weights `published`.

    The environment variable SOCNAV_CACHE names another folder than the user's cache.
    """

    source: tyro.conf.Positional[str]
    """A wheel of the package socnavgym, a folder with it, or socnavgym==0.1.1, which pip then downloads."""

    def run(self) -> None:
        """Import the weights and print where they are."""
        from reward_model.published import import_published

        with Console(stderr=True).status(f"importing the published network from {self.source}"):
            folder = import_published(self.source)
        print(folder)


@dataclass(frozen=True)
class Heatmaps:
    """Draw what a scene's scores would be at every position of the robot, as a PNG.

    The robot keeps its heading; in all frames everything is seen from its recorded path, shifted. With --actions there
    is also a map for each of six things the robot could be doing instead: turn left, stop, turn right, forward-left,
    forward, forward-right.
    """

    file: tyro.conf.Positional[Path]
    """SocNav2 JSON file."""
    output: Annotated[Path, tyro.conf.arg(aliases=("-o",))]
    """PNG file to write."""
    weights: str = "default"
    """default (what ships), published (after import-published) or a checkpoint folder."""
    question: Literal["q1", "q2", "both"] = "both"
    """Which of the two scores to draw."""
    resolution: int = 81
    """Positions along each side of the room."""
    actions: bool = False
    """Draw the six actions as well."""
    time_scale: float = 1.0
    """Play the scene this many times slower; the six actions are driven in its slowed time."""

    def run(self) -> None:
        """Read, score and draw, and print where the picture is."""
        if self.output.suffix.lower() != ".png":
            raise ValueError(f"output must end in .png, got {str(self.output)!r}")
        from reward_model.analysis.heatmap import ACTIONS, heatmap
        from reward_model.analysis.heatmap_figure import RECORDED, draw_heatmaps
        from reward_model.base.files import replace_file
        from reward_model.scenes.scene import ScenarioError
        from reward_model.scenes.socnav2_json import read_socnav2
        from reward_model.scenes.time_scale import check_factor, slowed
        from reward_model.scorer import load_scorer

        check_factor(self.time_scale)
        sequence = slowed(read_socnav2(self.file), self.time_scale)
        scorer = load_scorer(self.weights)
        actions = {RECORDED: None, **(ACTIONS if self.actions else {})}
        positions, begin = len(actions) * self.resolution**2, time.perf_counter()
        try:
            with progress_bars() as progress:
                task = progress.add_task("scoring", total=positions)
                advance = partial(progress.advance, task)
                maps = {
                    name: heatmap(scorer, sequence, doing, self.resolution, advance) for name, doing in actions.items()
                }
        except ScenarioError as error:
            raise ScenarioError(f"{self.file}: {error}") from error
        print(f"{positions:,} positions scored in {time.perf_counter() - begin:.1f} s", file=sys.stderr)
        questions: Sequence[Literal["q1", "q2"]] = ("q1", "q2") if self.question == "both" else (self.question,)
        replace_file(self.output, draw_heatmaps(sequence.last, maps, questions, f"{sequence.name}, {scorer.name}"))
        print(self.output)


@dataclass(frozen=True)
class Behaviours:
    """Check on synthetic scenes whether a network behaves as Bachiller et al. report of a good one.

    One row a statement: what was measured, what is claimed of the values, the values, and whether the claim holds.
    A statement that fails is reported in its row and changes nothing about the exit status.
    """

    weights: str = "default"
    """default (what ships), published (after import-published) or a checkpoint folder."""
    output_format: Literal["table", "markdown", "json"] = "table"
    """markdown is a table too; json is one list with the values in full."""

    def run(self) -> None:
        """Ask the network and print what was found."""
        from reward_model.analysis.behaviours import BEHAVIOURS, HEADER
        from reward_model.scorer import load_scorer

        scorer = load_scorer(self.weights)
        findings = [finding for behaviour in watched(BEHAVIOURS, "asking") for finding in behaviour(scorer)]
        if self.output_format == "json":
            print(json.dumps([finding.document() for finding in findings], indent=1, allow_nan=False))
        elif self.output_format == "markdown":
            rows = [HEADER, ("---",) * len(HEADER), *(finding.cells() for finding in findings)]
            print("\n".join(f"| {' | '.join(row)} |" for row in rows))
        else:
            table = Table(*HEADER, title=f"weights: {scorer.name}", show_lines=True)
            for finding in findings:
                table.add_row(*map(escape, finding.cells()))
            Console().print(table)


COMMANDS: Final[Mapping[str, type[Command]]] = {
    "score": Score,
    "heatmap": Heatmaps,
    "behaviours": Behaviours,
    "import-published": ImportPublished,
    "train": Train,
    "search": Search,
    "label": Label,
    "experiments": Experiments,
    "evaluate": Evaluate,
    "agreement": Agreement,
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status: 0, 2 for bad input, 130 when interrupted."""
    return run_command("python -m reward_model", COMMANDS, arguments)


def _score_lines(files: Sequence[Path], scores: Sequence[Scores], out_of_range: Sequence[tuple[str, ...]]) -> list[str]:
    rows = list(zip(files, scores, out_of_range, strict=True))
    problems = [file for file, each, _ in rows if not (math.isfinite(each.q1) and math.isfinite(each.q2))]
    if problems:
        remedy = "must have a finite score; are its lengths in metres?"
        raise ValueError("\n".join(f"{file}: {remedy}" for file in problems))
    return [json.dumps({"file": str(file), **each._asdict(), "out_of_range": reasons}) for file, each, reasons in rows]


def _read_windows(files: Sequence[Path], time_scale: float) -> list[list[FrameGraph]]:
    """Read the window of each file's last second, slowed; every problem goes into one error, a line each."""
    from reward_model.graph.windows import sequence_frames
    from reward_model.scenes.scene import ScenarioError
    from reward_model.scenes.socnav2_json import read_socnav2
    from reward_model.scenes.time_scale import slowed

    windows, problems = [], []
    for file in watched(files, "reading", least=100):
        try:
            sequence = read_socnav2(file)
            try:
                windows.append(sequence_frames(slowed(sequence, time_scale)))
            except ScenarioError as error:
                raise ScenarioError(f"{file}: {error}") from error
        except ScenarioError as error:
            problems.append(str(error))
    if problems:
        raise ScenarioError("\n".join(problems))
    return windows
