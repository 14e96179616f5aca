"""How fast everything is, in one table: `python -m benchmarks`.

Steps a second, where the time of a step goes, how far a step is from bare physics, the network beside DGL, resets,
imports, memory, and PPO. Figures are medians, with what 5 and 95 in 100 runs or steps stay below; each section says how
it was measured. docs/speed.md says what they mean. On a machine that does something else they mean little.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import torch
import tyro
from rich.console import Console
from rich.progress import track

from benchmarks import environment, learning, network, processes
from benchmarks.figures import Figure, document_figures, print_figures, write_figures

METHODS = {**environment.METHODS, **network.METHODS, **processes.METHODS, **learning.METHODS}


@dataclass(frozen=True)
class Options:
    """What to measure, and for how long.

    only: names of sections, all if there are none
    steps: environment steps in a run, of all worlds together
    runs: of each environment
    memory_steps: after which memory is looked at
    quick: a little of each in less than a minute, to see that it works and not how fast it is
    output: a JSON file for the figures
    document: a Markdown file to put the tables into, between the lines that docs/speed.md has for them
    """

    only: tuple[str, ...] = field(default=())
    steps: int = 4000
    runs: int = 5
    memory_steps: tuple[int, ...] = (100_000, 1_000_000)
    quick: bool = False
    output: Path | None = None
    document: Path | None = None


def main() -> None:
    """Measure what the command line asks for."""
    measure(tyro.cli(Options, description=__doc__))


def measure(options: Options) -> None:
    """Measure, print and write."""
    sections = measurements(options)
    chosen = options.only or tuple(sections)
    if unknown := sorted(set(chosen) - set(sections)):
        print(f"only must name sections of {', '.join(sections)}, got {', '.join(unknown)}", file=sys.stderr)
        sys.exit(2)
    torch.set_num_threads(1)
    figures: list[Figure] = []
    for section in track(chosen, "measuring", console=Console(stderr=True), transient=True):
        figures += sections[section]()
    print_figures(Console(), figures, METHODS)
    if options.output is not None:
        write_figures(options.output, figures, METHODS)
    if options.document is not None:
        document_figures(options.document, figures, METHODS)


def measurements(options: Options) -> dict[str, Callable[[], list[Figure]]]:
    """What there is to measure, by the names that `--only` takes."""
    quick, steps, runs, memory_steps = options.quick, options.steps, options.runs, options.memory_steps
    if quick:
        steps, runs, memory_steps = 32, 1, (64, 128)
    worlds = 4 if quick else environment.SIZES[-1]
    return {
        "rates": lambda: environment.rates(steps, runs, environment.SIZES[:2] if quick else environment.SIZES),
        "step": lambda: environment.step_parts(steps),
        "vector-step": lambda: environment.vector_parts(steps, worlds),
        "floor": lambda: environment.floor(steps),
        "reset": lambda: environment.resets(max(2, steps // 20)),
        "network": lambda: network.network_rates(steps, runs, network.BATCHES[:2] if quick else network.BATCHES),
        "import": lambda: processes.import_times(runs, processes.STATEMENTS[: 1 if quick else None]),
        "memory": lambda: processes.memory(memory_steps, worlds),
        "ppo": lambda: learning.learning_rates(runs, quick),
    }


if __name__ == "__main__":
    main()
