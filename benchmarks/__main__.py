"""How fast everything is, in one table: `python -m benchmarks`.

Steps a second, where the time of a step goes, how far a step is from bare physics, the network beside DGL, resets,
imports, memory, and PPO. Figures are medians, with what 5 and 95 in 100 runs or steps stay below; each section says how
it was measured. docs/speed.md says what they mean. On a machine that does something else they mean little.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from rich.console import Console

from benchmarks import environment, learning, network, processes
from benchmarks.figures import Figure, document_figures, print_figures, write_figures
from reward_model.base.commands import check_least, run_command
from reward_model.base.progress import watched

METHODS = {**environment.METHODS, **network.METHODS, **processes.METHODS, **learning.METHODS}


@dataclass(frozen=True)
class Benchmarks:
    """What to measure, and for how long."""

    only: tuple[str, ...] = ()
    """Names of sections, all if there are none."""
    steps: int = 4000
    """Environment steps in a run, of all worlds together."""
    runs: int = 5
    """Of each environment."""
    memory_steps: tuple[int, ...] = (100_000, 1_000_000)
    """After which memory is looked at."""
    quick: bool = False
    """A little of each in less than a minute, to see that it works and not how fast it is."""
    output: Path | None = None
    """A JSON file for the figures."""
    document: Path | None = None
    """A Markdown file to put the tables into, between the lines that docs/speed.md has for them."""

    def run(self) -> None:
        """Measure, print and write."""
        check_least(self, steps=1, runs=1)
        sections = measurements(self)
        chosen = self.only or tuple(sections)
        if unknown := sorted(set(chosen) - set(sections)):
            raise ValueError(f"only must name sections of {', '.join(sections)}, got {', '.join(unknown)}")
        torch.set_num_threads(1)
        figures: list[Figure] = []
        for section in watched(chosen, "measuring"):
            figures += sections[section]()
        print_figures(Console(), figures, METHODS)
        if self.output is not None:
            write_figures(self.output, figures, METHODS)
        if self.document is not None:
            document_figures(self.document, figures, METHODS)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    return run_command("python -m benchmarks", Benchmarks, arguments, __doc__)


def measurements(options: Benchmarks) -> dict[str, Callable[[], list[Figure]]]:
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
    sys.exit(main())
