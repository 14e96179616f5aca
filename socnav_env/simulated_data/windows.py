"""Training windows in bulk: simulated episodes with all drivers, the same for any number of jobs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Final

import joblib
import numpy as np

from reward_model.graph.frame import FrameGraph
from reward_model.graph.windows import frame_graph, select_window, wall_segments
from reward_model.networks.star import in_contact
from reward_model.scenes.scene import Snapshot
from socnav_env.config import EnvConfig
from socnav_env.episode import STANDING
from socnav_env.scenes.population import sample_layout
from socnav_env.simulated_data.drivers import DRIVERS, Driver
from socnav_env.simulated_data.wide_range import CROWDED, moved_close, random_world
from socnav_env.simulation.snapshots import Recorder
from socnav_env.simulation.world import World

WINDOWS_PER_EPISODE: Final = 8
_EPISODE_STEPS: Final = 90  # control periods after the warm-up, 18 s
_SWITCH: Final = 0.02  # chance, each control period, that another driver takes over
_INTERVALS: Final = (0.1, 0.2)  # s, range of the genuine recordings' snapshot spacing
_REVERSED_WALLS: Final = 0.15  # share of windows

MOST_WINDOWS: Final = 12  # of an episode over the wide range
_CANDIDATES: Final = 18  # moments of such an episode
_KEPT_IN_CONTACT: Final = 0.25  # share of windows
_MOVED: Final = 0.25  # share of windows
_CHUNK: Final = 25  # episodes that a process simulates at a time

Window = list[FrameGraph]
Episode = Callable[[np.random.Generator], list[Window]]
"""Simulates an episode and returns windows of it; picklable."""


def generate_windows(num_windows: int, seed: int, jobs: int = 1) -> list[Window]:
    """Windows of simulated episodes, `WINDOWS_PER_EPISODE` from each.

    Every episode has a seed of its own, so that the result does not depend on `jobs`, the number of processes.
    """
    num_episodes = -(-num_windows // WINDOWS_PER_EPISODE)
    chunks = [range(first, min(first + _CHUNK, num_episodes)) for first in range(0, num_episodes, _CHUNK)]
    parts = joblib.Parallel(n_jobs=jobs, return_as="generator")(
        joblib.delayed(windows_of_episodes)(ordinary_episode, seed, chunk) for chunk in chunks
    )
    return [window for part in parts for window in part][:num_windows]


def windows_of_episodes(episode: Episode, seed: int, indices: Iterable[int]) -> list[Window]:
    """The windows of the episodes that have these indices under a seed."""
    return [window for index in indices for window in episode(np.random.default_rng([seed, index]))]


def ordinary_episode(rng: np.random.Generator) -> list[Window]:
    """Windows of the default environment, half of the time crowded; some have walls in reverse, as mirrored scenes."""
    config = EnvConfig() if rng.random() < 0.5 else EnvConfig(population=CROWDED)
    windows = []
    for snapshots in _moments(World(sample_layout(config, rng), config, rng), rng, WINDOWS_PER_EPISODE):
        chosen = _retimed(snapshots, rng)
        if rng.random() < _REVERSED_WALLS:
            chosen = [replace(each, walls=each.walls[:, [2, 3, 0, 1]]) for each in chosen]
        windows.append(_frames(chosen))
    return windows


def wide_episode(rng: np.random.Generator) -> list[Window]:
    """Windows over the range of `wide_range`, at most `MOST_WINDOWS`.

    In some the robot is moved close to something. Most in which it is in contact are left out, as bodies that push each
    other would make up a third.
    """
    windows: list[Window] = []
    for snapshots in _moments(random_world(rng), rng, _CANDIDATES):
        moved = moved_close(snapshots, rng) if rng.random() < _MOVED else snapshots
        window = _frames(_retimed(moved, rng))
        touching = bool(in_contact(np.array([window[0].surroundings]))[0])
        if not touching or rng.random() < _KEPT_IN_CONTACT:
            windows.append(window)
        if len(windows) == MOST_WINDOWS:
            break
    return windows


def _moments(world: World, rng: np.random.Generator, count: int) -> Iterator[tuple[Snapshot, ...]]:
    """Drive the robot through an episode, and give the last snapshots at random moments."""
    control_period, warm_up_steps = world.config.control_period, world.config.warm_up_steps
    recorder = Recorder(world, control_period)
    for _ in range(warm_up_steps):
        world.advance(STANDING)
        recorder.record()
    driver = _random_driver(rng)
    chosen = set(rng.choice(_EPISODE_STEPS, count, replace=False).tolist())
    for step in range(_EPISODE_STEPS):
        if rng.random() < _SWITCH:
            driver = _random_driver(rng)
        world.advance(driver.command(world, rng))
        recorder.record()
        if step in chosen:
            yield recorder.snapshots


def _random_driver(rng: np.random.Generator) -> Driver:
    return list(DRIVERS.values())[rng.integers(len(DRIVERS))](rng)


def _retimed(snapshots: tuple[Snapshot, ...], rng: np.random.Generator) -> list[Snapshot]:
    """The snapshots of the window, newest first, half of the time as if recorded at another rate."""
    chosen = [snapshots[index] for index in select_window([each.timestamp for each in snapshots])]
    if rng.random() < 0.5:
        chosen = [replace(each, interval=rng.uniform(*_INTERVALS)) for each in chosen]
    return chosen


def _frames(chosen: list[Snapshot]) -> Window:
    segments = wall_segments(chosen[0].walls)
    return [frame_graph(each, segments) for each in chosen]
