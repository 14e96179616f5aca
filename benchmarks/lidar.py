"""How fast the beams of `lidar` are, against the physics' own segment queries: `python -m benchmarks.lidar`.

Both scan the same room with eight people and as many tables and plants, with the same beams, and must agree. They take
turns, so that a machine that slows down slows both down. Figures are microseconds of a scan: medians over the runs.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np
import pymunk
from numpy.typing import NDArray
from rich.console import Console

from reward_model.base.commands import check_least, run_command
from reward_model.base.files import replace_file
from socnav_env.config import EnvConfig, PopulationConfig
from socnav_env.observations import LidarObservation
from socnav_env.scenes.population import sample_layout
from socnav_env.simulation.world import World

CROWD = PopulationConfig(still=(4, 4), wandering=(4, 4), tables=(3, 3), plants=(2, 2), interactions=(0, 0))
AGREEMENT = 1e-5  # m


@dataclass(frozen=True)
class Lidar:
    """How long to measure."""

    scans: int = 200
    """In a run."""
    runs: int = 15
    """Of each."""
    quick: bool = False
    """A few scans of each, to see that it works and not how fast it is."""
    output: Path | None = None
    """A JSON file for the figures."""

    def run(self) -> None:
        """Measure, print and write."""
        check_least(self, scans=1, runs=1)
        scans, runs = (5, 3) if self.quick else (self.scans, self.runs)
        config, random = EnvConfig(population=CROWD), np.random.default_rng(0)
        world, lidar = World(sample_layout(config, random), config, random), LidarObservation(config)
        scanners = {"compiled": lambda: lidar.observe(world, 1.0)["lidar"], "pymunk": _segment_queries(world, lidar)}
        first, second = (scan() for scan in scanners.values())
        assert np.abs(np.asarray(first) - np.asarray(second)).max() < AGREEMENT, "both must see the same"
        times: dict[str, list[float]] = {name: [] for name in scanners}
        for _ in range(runs):
            for name, scan in scanners.items():
                times[name].append(_timed(scan, scans))
        figures = {name: median(each) for name, each in times.items()}
        console = Console()
        for name, microseconds in figures.items():
            console.print(f"{name}: {microseconds:.1f} us a scan of {len(lidar.beams)} beams")
        console.print(f"ratio: {figures['pymunk'] / figures['compiled']:.1f}")
        if self.output is not None:
            replace_file(self.output, (json.dumps(figures, indent=2) + "\n").encode())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    return run_command("python -m benchmarks.lidar", Lidar, arguments, __doc__)


def _segment_queries(world: World, lidar: LidarObservation) -> Callable[[], list[float]]:
    """The same scan by `Space.segment_query_first` in a space with the same shapes."""
    space, around = pymunk.Space(), world.obstacles()
    fixed = space.static_body
    space.add(*(pymunk.Segment(fixed, (x1, y1), (x2, y2), 0.0) for x1, y1, x2, y2 in around.walls.tolist()))
    space.add(*(pymunk.Circle(fixed, radius, (x, y)) for x, y, radius in around.discs.tolist()))
    space.add(*(pymunk.Poly(fixed, _corners(box)) for box in around.boxes))
    everything, longest = pymunk.ShapeFilter(), world.config.sensors.lidar_range
    x, y, heading = world.robot_pose.tolist()

    def scan() -> list[float]:
        distances = []
        for angle in (heading + lidar.beams).tolist():
            end = x + longest * math.cos(angle), y + longest * math.sin(angle)
            hit = space.segment_query_first((x, y), end, 0.0, everything)
            distances.append(longest if hit is None else longest * hit.alpha)
        return distances

    return scan


def _corners(box: NDArray[np.float64]) -> list[tuple[float, float]]:
    x, y, cosine, sine, half_width, half_depth = box.tolist()
    turn = np.array([[cosine, sine], [-sine, cosine]])
    local = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * (half_width, half_depth)
    return [(x + dx, y + dy) for dx, dy in (local @ turn).tolist()]


def _timed(scan: Callable[[], object], scans: int) -> float:
    start = time.perf_counter()
    for _ in range(scans):
        scan()
    return (time.perf_counter() - start) / scans * 1e6


if __name__ == "__main__":
    sys.exit(main())
