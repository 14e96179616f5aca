"""Scenes a second of the reward network, on the windows of environments, beside DGL."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final

import numpy as np

from benchmarks.figures import Figure
from benchmarks.scoring import loaded_on_dgl
from benchmarks.speed_loops import make_vector, threads_of_torch
from reward_model.scorer import load_scorer

NETWORK: Final = "Network"
METHODS: Final = {
    NETWORK: "scenes a second of the default network, windows fresh from as many worlds; DGL one by one, with "
    "denormals flushed, on the same windows"
}
BATCHES = (1, 16, 64, 256)
ON_DGL = 4  # windows of a batch that DGL scores as well


def network_rates(steps: int, runs: int, batches: Sequence[int]) -> list[Figure]:
    """Scenes a second by batch size, of the compiled form and of DGL, and their ratio."""
    on_dgl = loaded_on_dgl(partial(load_scorer, "default"))
    figures = []
    for batch in batches:
        compiled, dgl = _rates(batch, max(runs, steps // batch), runs, on_dgl)
        figures.append(Figure(NETWORK, f"compiled, {batch} at once", "1/s", compiled))
        if (cores := os.cpu_count() or 1) > 1 and batch > 1:
            with threads_of_torch(cores):
                threaded, _ = _rates(batch, max(runs, steps // batch), 0, None)
            figures.append(Figure(NETWORK, f"compiled, {batch} at once, {cores} threads", "1/s", threaded))
        if dgl:
            ratio = float(np.median(compiled) / np.median(dgl))
            figures += [Figure(NETWORK, f"DGL, windows of {batch} worlds", "1/s", dgl)]
            figures += [Figure(NETWORK, f"compiled, {batch} at once, DGL = 1", "", [ratio])]
    return figures


def _rates(batch: int, rounds: int, runs: int, on_dgl: Callable[[Any], Any] | None) -> tuple[list[float], list[float]]:
    """Scenes a second of both forms on the windows of worlds with the learned reward; of DGL in a few steps only."""
    environments = make_vector(batch, reward="learned")
    environments.reset(seed=0)
    score = environments.envs[0].reward.scorer.score_windows
    compiled, dgl = [], []
    for step, actions in enumerate(np.random.default_rng(0).uniform(-1, 1, (rounds + 1, batch, 2))):
        _, _, terminations, truncations, _ = environments.step(actions)
        windows = environments.call("window")
        begin = time.perf_counter()
        score(windows)
        compiled.append(batch / (time.perf_counter() - begin))
        if on_dgl is not None and step <= runs:
            begin = time.perf_counter()
            on_dgl(windows[:ON_DGL])
            dgl.append(len(windows[:ON_DGL]) / (time.perf_counter() - begin))
        ended = terminations | truncations
        if ended.any():
            environments.reset(options={"reset_mask": ended})
    return compiled[1:], dgl[1:]
