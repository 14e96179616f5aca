"""How people walk in SocNav2's recordings and here: `python -m benchmarks.realism.walking --data DIR`.

DIR holds SocNav2 sequences (`S*.json`). Everyone counts who stirs in a sequence by more than 0.1 m. Velocities are
means over 0.5 s, accelerations their change from one to the next: between neighbouring snapshots the recordings tell
neither, since places and timestamps were not taken at quite the same time. Simulated: 4 s of episodes with the default
configuration, a robot driving at random among people.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.interpolate import interp1d

from reward_model import read_socnav2
from reward_model.base.arrays import FloatArray
from reward_model.base.commands import check_least, run_command
from socnav_env.config import EnvConfig
from socnav_env.scenes.population import sample_layout
from socnav_env.simulation.world import World
from socnav_env.trajectories.from_socnav2 import trajectory_of_sequence

PERCENTILES = (5, 25, 50, 75, 95)
PERIOD = 0.5  # s between the instants that are compared
STIRS = 0.1  # m within which someone stays who stands
SECONDS = 4.0  # of a simulated sequence
COMMAND_PERIOD = 10  # control periods for which the robot keeps to one command


class Walking(NamedTuple):
    """What people who walk do, one number for each person and instant [m/s], [m/s^2], [rad/s]."""

    speeds: FloatArray
    accelerations: FloatArray
    turn_rates: FloatArray


@dataclass(frozen=True)
class Compare:
    """What is compared."""

    data: Path
    """Folder with SocNav2 sequences, S*.json."""
    scenes: int = 200
    """How many are simulated."""
    seed: int = 0
    """Of the simulation."""

    def run(self) -> None:
        """Measure and print."""
        check_least(self, scenes=1, seed=0)
        files = sorted(self.data.glob("S*.json"))
        if not files:
            raise ValueError(f"{self.data}: must hold SocNav2 sequences, S*.json, found none")
        recorded, simulated = recorded_walking(files), simulated_walking(self.scenes, self.seed)
        Console().print(_table(len(files), recorded, self.scenes, simulated))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    return run_command("python -m benchmarks.realism.walking", Compare, arguments, __doc__)


def recorded_walking(files: list[Path]) -> Walking:
    """Everyone who walks in SocNav2 sequences. Raises `ScenarioError` for a file that cannot be used."""
    each = []
    for file in files:
        trajectory = trajectory_of_sequence(read_socnav2(file))
        each.append(walking_of(trajectory.people_poses, trajectory.times))
    return _together(each)


def simulated_walking(scenes: int, seed: int) -> Walking:
    """Everyone who walks in so many scenes of the default environment, a robot driving at random among them."""
    config, rng = EnvConfig(), np.random.default_rng(seed)
    steps, each = round(SECONDS / config.control_period), []
    fastest = (config.robot.max_forward_speed, 0.0, config.robot.max_turn_rate)
    for _ in range(scenes):
        world = World(sample_layout(config, rng), config, rng)
        for _ in range(config.warm_up_steps):
            world.advance(np.zeros(3))
        poses = [world.people_poses]
        for step in range(steps):
            if step % COMMAND_PERIOD == 0:
                command = rng.uniform(-1.0, 1.0, 3) * fastest
            world.advance(command)
            poses.append(world.people_poses)
        each.append(walking_of(np.array(poses), config.control_period * np.arange(steps + 1)))
    return _together(each)


def walking_of(poses: FloatArray, times: FloatArray) -> Walking:
    """poses: (n, num_people, 3), NaN while out of sight; times: (n,) [s]."""
    extent = np.fmax.reduce(poses[..., :2], axis=0) - np.fmin.reduce(poses[..., :2], axis=0)
    walks = extent.max(axis=1, initial=0.0) > STIRS
    unrolled = np.concatenate([poses[:, walks, :2], np.unwrap(poses[:, walks, 2:], axis=0)], axis=2)
    instants = np.arange(times[0], times[-1], PERIOD)
    rates = np.diff(interp1d(times, unrolled, axis=0)(instants), axis=0) / PERIOD
    changes = np.diff(rates[..., :2], axis=0) / PERIOD
    found = (np.linalg.norm(rates[..., :2], axis=2), np.linalg.norm(changes, axis=2), np.abs(rates[..., 2]))
    return Walking(*(values[~np.isnan(values)] for values in found))


def _together(each: list[Walking]) -> Walking:
    return Walking(*(np.concatenate(values) for values in zip(*each, strict=True)))


def _table(sequences: int, recorded: Walking, scenes: int, simulated: Walking) -> Table:
    table = Table(title=f"People who walk: {sequences} recorded sequences, {scenes} simulated scenes")
    for heading in ("of people who walk", "who", *(f"{percent} %" for percent in PERCENTILES)):
        table.add_column(heading, justify="left" if heading.endswith(("walk", "who")) else "right")
    quantities = ("speed [m/s]", "acceleration [m/s^2]", "turn rate [rad/s]")
    for quantity, one, other in zip(quantities, recorded, simulated, strict=True):
        for who, values in (("recorded", one), ("simulated", other)):
            table.add_row(quantity, who, *(f"{value:.2f}" for value in np.percentile(values, PERCENTILES)))
    return table


if __name__ == "__main__":
    sys.exit(main())
