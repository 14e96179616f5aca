"""What has to be measured in a process of its own: how long an import takes, how much memory playing takes.

`python -m benchmarks.processes NUM_ENVS STEPS...` plays so many worlds with the learned reward and prints the megabytes
of memory that the process holds after each number of steps.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import tyro

from benchmarks.figures import Figure
from reward_model.base.commands import check_least, run_command

IMPORTS, MEMORY = "Import", "Memory"
METHODS: Final = {
    IMPORTS: "seconds that a fresh Python takes for it, less those it takes for nothing",
    MEMORY: "resident megabytes of one process after so many steps of all worlds, learned reward, random actions",
}
STATEMENTS = ("import socnav_env", "import socnav_env.env", "import reward_model.scorer", "import agents")
HEAVY = ("torch", "dgl", "numba")  # what `import socnav_env` leaves alone


def import_times(runs: int, statements: Sequence[str]) -> list[Figure]:
    """Seconds of each import. Raises `CalledProcessError` where `import socnav_env` loads too much."""
    loaded = f"import sys, socnav_env; sys.exit(' '.join({set(HEAVY)} & set(sys.modules)) or None)"
    subprocess.run([sys.executable, "-c", loaded], check=True)
    values: dict[str, list[float]] = {statement: [] for statement in ("pass", *statements)}
    for run in range(runs + 1):
        for statement, seconds in values.items():  # the first run has the files read
            begin = time.perf_counter()
            subprocess.run([sys.executable, "-c", statement], check=True)
            if run > 0:
                seconds.append(time.perf_counter() - begin)
    nothing = min(values.pop("pass"))
    return [Figure(IMPORTS, name, "s", [each - nothing for each in seconds]) for name, seconds in values.items()]


def memory(steps: Sequence[int], num_envs: int) -> list[Figure]:
    """Megabytes after each number of steps, and by how much they have grown from the first to the last."""
    command = [sys.executable, "-m", "benchmarks.processes", str(num_envs), *map(str, steps)]
    answer = subprocess.run(command, check=True, capture_output=True, text=True)
    megabytes = json.loads(answer.stdout)
    figures = [
        Figure(MEMORY, f"{num_envs} worlds, after {after:,} steps", "MB", [held])
        for after, held in zip(steps, megabytes, strict=True)
    ]
    growth = 100 * (megabytes[-1] / megabytes[0] - 1)
    return [*figures, Figure(MEMORY, f"growth from {steps[0]:,} steps on", "%", [growth])]


@dataclass(frozen=True)
class Memory:
    """What to play."""

    num_envs: tyro.conf.Positional[int]
    """Worlds that are played side by side."""
    steps: tyro.conf.Positional[tuple[int, ...]]
    """After which memory is looked at, of all worlds together."""

    def run(self) -> None:
        """Play and print."""
        check_least(self, num_envs=1)
        import numpy as np

        from benchmarks.speed_loops import make_vector

        environments = make_vector(self.num_envs, reward="learned")
        environments.reset(seed=0)
        random, megabytes, played = np.random.default_rng(0), [], 0
        for wanted in self.steps:
            while played < wanted:
                _, _, terminations, truncations, _ = environments.step(random.uniform(-1, 1, (self.num_envs, 2)))
                ended = terminations | truncations
                if ended.any():
                    environments.reset(options={"reset_mask": ended})
                played += self.num_envs
            megabytes.append(_resident() / 1e6)
        print(json.dumps(megabytes))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    return run_command("python -m benchmarks.processes", Memory, arguments, __doc__)


def _resident() -> int:
    """Bytes of memory that this process holds; Linux tells."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize()


if __name__ == "__main__":
    sys.exit(main())
