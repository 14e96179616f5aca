"""How well an agent does: episodes over fixed seeds, their measures, and means with bootstrap intervals."""

from __future__ import annotations

import signal
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.envs import EnvironmentMaker
from agents.policy import Policy, act

EVALUATION_SEEDS = 1_000_000  # the first seed of evaluations, far from the seeds that training counts on from
SELECTION_SEEDS = 2_000_000  # the first seed of evaluations during training
RESAMPLES = 2_000  # of the bootstrap
CONFIDENCE = 0.95
CHUNK = 5  # episodes a process takes at a time


@dataclass(frozen=True)
class EpisodeRecord:
    """What came of one episode.

    Attributes:
        seed: what the environment was reset with
        outcome: `arrived`, `collision_person`, `collision_object`, `collision_wall` or `timeout`
        episode_return: the undiscounted sum of rewards
        length: control steps
        metrics: the environment's `episode_metrics`; NaN where a measure does not apply
    """

    seed: int
    outcome: str
    episode_return: float
    length: int
    metrics: dict[str, float]


@dataclass(frozen=True)
class Interval:
    """A mean over episodes and its 95 % bootstrap interval; `episodes` counts those the measure applies to."""

    mean: float
    low: float
    high: float
    episodes: int


@dataclass(frozen=True)
class Evaluation:
    """The episodes of one agent and their summary by measure (`return`, `length` and the episode metrics)."""

    episodes: tuple[EpisodeRecord, ...]
    summary: dict[str, Interval]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values that JSON can hold."""
        return asdict(self)


def evaluation_seeds(count: int, first: int = EVALUATION_SEEDS) -> list[int]:
    """Return the `count` fixed seeds that every evaluation uses."""
    return list(range(first, first + count))


def evaluate(
    policy: Policy,
    make: EnvironmentMaker,
    seeds: Sequence[int],
    jobs: int = 2,
    deterministic: bool = True,
) -> Evaluation:
    """Play one episode for each seed and summarise them.

    The result does not depend on `jobs`.

    Args:
        policy: the agent.
        make: makes the environment; it and the policy must be picklable where jobs > 1.
        seeds: one episode each.
        jobs: processes that share the episodes.
        deterministic: whether the agent takes its most probable action.
    """
    from joblib import Parallel, delayed

    chunks = [seeds[start : start + CHUNK] for start in range(0, len(seeds), CHUNK)]
    if jobs == 1:
        played = [play_episodes(policy, make, seeds, deterministic)]
    else:
        played = Parallel(n_jobs=min(jobs, len(chunks)))(
            delayed(_play_in_worker)(policy, make, chunk, deterministic) for chunk in chunks
        )
    episodes = tuple(record for part in played for record in part)
    return Evaluation(episodes, summarise(episodes))


def play_episodes(
    policy: Policy, make: EnvironmentMaker, seeds: Iterable[int], deterministic: bool
) -> list[EpisodeRecord]:
    """Play one episode for each seed in this process."""
    import torch

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    env = make()
    try:
        return [_play(policy, env, seed, deterministic) for seed in seeds]
    finally:
        env.close()
        torch.set_num_threads(threads)


def _play_in_worker(
    policy: Policy, make: EnvironmentMaker, seeds: Iterable[int], deterministic: bool
) -> list[EpisodeRecord]:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides when to stop
    return play_episodes(policy, make, seeds, deterministic)


def _play(policy: Policy, env: Any, seed: int, deterministic: bool) -> EpisodeRecord:
    observation, info = env.reset(seed=seed)
    total, length, ended = 0.0, 0, False
    while not ended:
        action = act(policy, env, observation, deterministic)
        observation, reward, terminated, truncated, info = env.step(action)
        total += float(reward)
        length += 1
        ended = terminated or truncated
    metrics = {name: float(value) for name, value in info["episode_metrics"].items() if value is not None}
    return EpisodeRecord(seed, str(info["outcome"]), total, length, metrics)


def summarise(episodes: Sequence[EpisodeRecord]) -> dict[str, Interval]:
    """Return mean and bootstrap interval of every measure over the episodes it applies to."""
    columns: dict[str, list[float]] = {
        "success": [float(record.outcome == "arrived") for record in episodes],
        "return": [record.episode_return for record in episodes],
        "length": [float(record.length) for record in episodes],
    }
    for name in sorted({name for record in episodes for name in record.metrics}):
        columns[name] = [record.metrics.get(name, np.nan) for record in episodes]
    return {name: bootstrap_interval(np.asarray(values)) for name, values in columns.items()}


def bootstrap_interval(values: NDArray[np.float64]) -> Interval:
    """Return the mean of the values that are finite and its percentile bootstrap interval (Efron 1979)."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return Interval(np.nan, np.nan, np.nan, 0)
    picks = np.random.default_rng(0).integers(len(finite), size=(RESAMPLES, len(finite)))
    tail = 100 * (1 - CONFIDENCE) / 2
    low, high = np.percentile(finite[picks].mean(axis=1), [tail, 100 - tail])
    return Interval(float(finite.mean()), float(low), float(high), len(finite))
