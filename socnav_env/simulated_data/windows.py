"""Training windows in bulk: simulated episodes with all drivers, the same for any number of jobs."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import joblib
import numpy as np

from reward_model.graph.frame import FrameGraph
from reward_model.graph.windows import frame_graph, select_window, wall_segments
from reward_model.scenes.scene import Snapshot
from socnav_env.config import EnvConfig, PopulationConfig
from socnav_env.episode import STANDING
from socnav_env.scenes.population import sample_layout
from socnav_env.simulated_data.drivers import DRIVERS, Driver
from socnav_env.simulation.snapshots import Recorder
from socnav_env.simulation.world import World

WINDOWS_PER_EPISODE: Final = 8
_EPISODE_STEPS: Final = 90  # control periods after the warm-up, 18 s
_SWITCH: Final = 0.02  # chance, each control period, that another driver takes over
_INTERVALS: Final = (0.1, 0.2)  # s, range of the genuine recordings' snapshot spacing
_REVERSED_WALLS: Final = 0.15  # share of windows

# As many people and objects as in SocNav2's scenes (up to 14 and 11), more often than by default.
CROWDED: Final = PopulationConfig(still=(0, 6), wandering=(0, 6), tables=(0, 3), plants=(0, 3), interactions=(0, 3))


def generate_windows(num_windows: int, seed: int, jobs: int = 1) -> list[list[FrameGraph]]:
    """Windows of simulated episodes, `WINDOWS_PER_EPISODE` from each.

    Every episode has a seed of its own, so that the result does not depend on `jobs`, the number of processes.
    """
    num_episodes = -(-num_windows // WINDOWS_PER_EPISODE)
    chunks = np.array_split(np.arange(num_episodes), max(1, num_episodes // 25))
    parts = joblib.Parallel(n_jobs=jobs, return_as="generator")(
        joblib.delayed(_episodes)(seed, [int(index) for index in chunk]) for chunk in chunks
    )
    return [window for part in parts for window in part][:num_windows]


def _episodes(seed: int, indices: list[int]) -> list[list[FrameGraph]]:
    return [window for index in indices for window in _episode(np.random.default_rng([seed, index]))]


def _episode(rng: np.random.Generator) -> list[list[FrameGraph]]:
    config = EnvConfig() if rng.random() < 0.5 else EnvConfig(population=CROWDED)
    world = World(sample_layout(config, rng), config, rng)
    recorder = Recorder(world, config.control_period)
    for _ in range(config.warm_up_steps):
        world.advance(STANDING)
        recorder.record()
    driver = _random_driver(rng)
    chosen = set(rng.choice(_EPISODE_STEPS, WINDOWS_PER_EPISODE, replace=False).tolist())
    windows = []
    for step in range(_EPISODE_STEPS):
        if rng.random() < _SWITCH:
            driver = _random_driver(rng)
        world.advance(driver.command(world, rng))
        recorder.record()
        if step in chosen:
            windows.append(_window(recorder.snapshots, rng))
    return windows


def _random_driver(rng: np.random.Generator) -> Driver:
    return list(DRIVERS.values())[rng.integers(len(DRIVERS))](rng)


def _window(snapshots: tuple[Snapshot, ...], rng: np.random.Generator) -> list[FrameGraph]:
    """The window of the last snapshots, with times that vary as in recordings.

    Half of the windows are as if recorded at another rate; some have walls in reverse order, as in mirrored scenes.
    """
    chosen = [snapshots[index] for index in select_window([each.timestamp for each in snapshots])]
    if rng.random() < 0.5:
        chosen = [replace(each, interval=rng.uniform(*_INTERVALS)) for each in chosen]
    if rng.random() < _REVERSED_WALLS:
        chosen = [replace(each, walls=each.walls[:, [2, 3, 0, 1]]) for each in chosen]
    segments = wall_segments(chosen[0].walls)
    return [frame_graph(each, segments) for each in chosen]
