"""Steps a second of `SocNav2-v0` in one process, by reward: `python -m benchmarks.environment`.

Every run plays the same seeds with the same random actions, resets included; rewards take turns, so that a machine
that slows down slows all of them down. Figures are medians over the runs, with the slowest and the fastest.
"""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import gymnasium as gym
import numpy as np
import torch
import tyro
from rich.console import Console
from rich.table import Table

import socnav_env  # noqa: F401 - registers SocNav2-v0
from reward_model.files import replace_file

REWARDS = ("learned", "q2", "crowdnav", "sparse")
REFERENCE = "crowdnav"  # what the others are compared with


@dataclass(frozen=True)
class Options:
    """How long to measure.

    steps: environment steps in a run
    runs: of each reward
    quick: a few steps of each, to see that it works and not how fast it is
    output: a JSON file for the figures
    """

    steps: int = 2000
    runs: int = 5
    quick: bool = False
    output: Path | None = None


def main() -> None:
    """Measure and print."""
    options = tyro.cli(Options, description=__doc__)
    steps, runs = (50, 2) if options.quick else (options.steps, options.runs)
    torch.set_num_threads(1)
    environments = {reward: gym.make("SocNav2-v0", reward=reward) for reward in REWARDS}
    for environment in environments.values():
        steps_per_second(environment, 50)
    rates: dict[str, list[float]] = {reward: [] for reward in REWARDS}
    for _ in range(runs):
        for reward, environment in environments.items():
            rates[reward].append(steps_per_second(environment, steps))
    Console().print(_table(rates, steps, runs))
    if options.output is not None:
        figures = {"steps": steps, "steps_per_second": rates}
        replace_file(options.output, (json.dumps(figures, indent=2) + "\n").encode())


def steps_per_second(environment: gym.Env[object, object], steps: int) -> float:
    """Play random actions from fixed seeds, resets included."""
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1, 1, (steps, 2)).astype(np.float32)
    seed, ended = 0, True
    begin = time.perf_counter()
    for action in actions:
        if ended:
            environment.reset(seed=seed)
            seed += 1
        _, _, terminated, truncated, _ = environment.step(action)
        ended = terminated or truncated
    return steps / (time.perf_counter() - begin)


def _table(rates: dict[str, list[float]], steps: int, runs: int) -> Table:
    table = Table(title=f"Steps a second, one process, random actions, {runs} runs of {steps} steps")
    for heading in ("reward", "median", "slowest", "fastest", f"time of {REFERENCE}'s"):
        table.add_column(heading, justify="left" if heading == "reward" else "right")
    reference = median(rates[REFERENCE])
    for reward, values in rates.items():
        figures = (median(values), min(values), max(values))
        table.add_row(reward, *(f"{value:,.0f}" for value in figures), f"{reference / median(values):.2f} x")
    return table


if __name__ == "__main__":
    main()
