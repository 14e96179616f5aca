"""Steps a second of `SocNav2-v0` in one process, and where the time goes: `python -m benchmarks.environment`.

Rates: single environments by reward, and vector environments with the learned reward by their number of worlds. All
play from the same seeds with random actions and take turns, so that a machine that slows down slows all of them down.
Resets are made but do not count. Figures are medians over the runs, with the slowest and the fastest.

Parts: microseconds of a step in a single environment with the learned reward, and of a reset: medians, and what the
fastest twentieth stay below.
"""

from __future__ import annotations

import json
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import gymnasium as gym
import numpy as np
import torch
import tyro
from gymnasium.vector import AutoresetMode
from rich.console import Console
from rich.table import Table

from reward_model.files import replace_file
from socnav_env import world as world_module
from socnav_env.env import SocNavEnv
from socnav_env.snapshots import Recorder

REWARDS = ("learned", "q2", "crowdnav", "sparse")
SIZES = (1, 4, 16, 64)
REFERENCE = "learned"  # what the others are compared with
STEP, RESET = "whole step", "reset"
SCENE_STEPS = 32  # that a single environment plays before it goes on to the next seed's scene

Rates = dict[str, list[float]]
Parts = dict[str, list[float]]
Player = Callable[[int], float]  # plays so many steps and returns steps a second


@dataclass(frozen=True)
class Options:
    """How long to measure.

    steps: environment steps in a run, of all worlds together
    runs: of each environment
    threads: that the network may use, for several worlds at a time
    quick: a few steps of each, to see that it works and not how fast it is
    output: a JSON file for the figures
    """

    steps: int = 2000
    runs: int = 5
    threads: int = 1
    quick: bool = False
    output: Path | None = None


def main() -> None:
    """Measure and print."""
    options = tyro.cli(Options, description=__doc__)
    steps, runs = (64, 2) if options.quick else (options.steps, options.runs)
    torch.set_num_threads(options.threads)
    rates, parts = measured_rates(steps, runs), step_parts(steps)
    console = Console()
    console.print(_rates_table(rates, steps, runs, options.threads))
    console.print(_parts_table(parts))
    if options.output is not None:
        figures = {"steps": steps, "threads": options.threads, "steps_per_second": rates, "step_microseconds": parts}
        replace_file(options.output, (json.dumps(figures, indent=2) + "\n").encode())


def measured_rates(steps: int, runs: int) -> Rates:
    """Steps a second of every environment in every run, after one that does not count."""
    players = {reward: _single_player(reward) for reward in REWARDS}
    players |= {f"learned, vector of {size}": _vector_player(size) for size in SIZES}
    rates: Rates = {name: [] for name in players}
    for run in range(runs + 1):
        for name, play in players.items():
            rate = play(steps)
            if run > 0:
                rates[name].append(rate)
    return rates


def step_parts(steps: int) -> Parts:
    """Microseconds that each part of every step took."""
    environment = SocNavEnv()
    _play_single(environment, steps)
    spent: defaultdict[str, float] = defaultdict(float)
    with ExitStack() as stack:
        timed: tuple[tuple[str, Any, str], ...] = (
            ("physics and people", world_module, "simulate"),
            ("snapshot and graph", Recorder, "record"),
            ("network", environment.reward.scorer, "score_windows"),
            ("observation", environment.observation, "observe"),
            (STEP, environment, "step"),
            (RESET, environment, "reset"),
        )
        for part, owner, name in timed:
            stack.enter_context(_timed(owner, name, part, spent))
        rows: list[defaultdict[str, float]] = []

        def note() -> None:
            rows.append(spent.copy())
            spent.clear()

        _play_single(environment, steps, note)
    steps_taken = [row for row in rows if row[STEP]]
    parts = {part: [1e6 * row[part] for row in steps_taken] for part in steps_taken[0]}
    named = [parts[part] for part in parts if part != STEP]
    parts["all else"] = [whole - sum(rest) for whole, *rest in zip(parts[STEP], *named, strict=True)]
    return parts | {RESET: [1e6 * row[RESET] for row in rows if row[RESET]]}


def _single_player(reward: str) -> Player:
    environment = gym.make("SocNav2-v0", reward=reward, disable_env_checker=True)
    return lambda steps: _play_single(environment, steps)


def _play_single(environment: gym.Env[Any, Any], steps: int, after_call: Callable[[], object] = lambda: None) -> float:
    """Play random actions in scene after scene, since some have many people, and return steps a second."""
    seconds, seed, ended = 0.0, 0, True
    for step, action in enumerate(np.random.default_rng(0).uniform(-1, 1, (steps, 2)).astype(np.float32)):
        if ended or step % SCENE_STEPS == 0:
            environment.reset(seed=seed)
            after_call()
            seed += 1
        begin = time.perf_counter()
        _, _, terminated, truncated, _ = environment.step(action)
        seconds += time.perf_counter() - begin
        after_call()
        ended = terminated or truncated
    return steps / seconds


def _vector_player(num_envs: int) -> Player:
    environments = gym.make_vec("SocNav2-v0", num_envs, autoreset_mode=AutoresetMode.DISABLED)

    def play(steps: int) -> float:
        seconds, rounds = 0.0, -(-steps // num_envs)
        environments.reset(seed=0)
        for actions in np.random.default_rng(0).uniform(-1, 1, (rounds, num_envs, 2)).astype(np.float32):
            begin = time.perf_counter()
            _, _, terminations, truncations, _ = environments.step(actions)
            seconds += time.perf_counter() - begin
            ended = terminations | truncations
            if ended.any():
                environments.reset(options={"reset_mask": ended})
        return rounds * num_envs / seconds

    return play


@contextmanager
def _timed(owner: Any, name: str, part: str, spent: defaultdict[str, float]) -> Iterator[None]:
    """Add the seconds that calls of a function take to `spent`."""
    function, is_own = getattr(owner, name), name in vars(owner)

    def timed(*args: Any, **kwargs: Any) -> Any:
        begin = time.perf_counter()
        try:
            return function(*args, **kwargs)
        finally:
            spent[part] += time.perf_counter() - begin

    setattr(owner, name, timed)
    try:
        yield
    finally:
        if is_own:
            setattr(owner, name, function)
        else:
            delattr(owner, name)


def _rates_table(rates: Rates, steps: int, runs: int, threads: int) -> Table:
    title = f"Steps a second, one process, threads: {threads}, random actions, {runs} runs of {steps} steps"
    table = Table(title=title)
    for heading in ("environment", "median", "slowest", "fastest", f"median, {REFERENCE} = 1"):
        table.add_column(heading, justify="left" if heading == "environment" else "right")
    reference = median(rates[REFERENCE])
    for name, values in rates.items():
        figures = (median(values), min(values), max(values))
        table.add_row(name, *(f"{value:,.0f}" for value in figures), f"{median(values) / reference:.2f}")
    return table


def _parts_table(parts: Parts) -> Table:
    table = Table(title="Microseconds of a step, single environment, learned reward")
    for heading in ("part", "median", "fastest 5 %"):
        table.add_column(heading, justify="left" if heading == "part" else "right")
    for part, values in sorted(parts.items(), key=lambda item: median(item[1])):
        table.add_row(part, f"{median(values):,.0f}", f"{np.percentile(values, 5):,.0f}")
    return table


if __name__ == "__main__":
    main()
