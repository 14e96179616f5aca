"""The commands of `python -m socnav_env`. Each loads what it needs when it runs, so that `--help` is quick."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final

import tyro

from reward_model.base.commands import USER_ERROR, Command, Files, check_least, print_error, run_command
from reward_model.base.files import replace_file
from socnav_env.commands.pictures import Output, Play, Render
from socnav_env.config import EnvConfig, PeopleConfig, RobotConfig

PROGRAM: Final = "python -m socnav_env"
DIFFERENT: Final = 1
BROKEN_OFF: Final = 1
ZIP_START: Final = b"PK"


@dataclass(frozen=True)
class Replay:
    """Simulate recordings again and compare every bit: exit status 1 where one differs, 2 where one cannot be read.

    A recording of other versions is refused. A line on stdout says for each file whether it is identical, or where it
    first differs.
    """

    files: Files
    """Files that RecordTrajectory wrote."""

    def run(self) -> int:
        """Go through the files, bad ones included."""
        if not self.files:
            raise ValueError("replay needs at least one file")
        return max(_reported(file) for file in self.files)


@dataclass(frozen=True)
class Metrics:
    """Measure an episode: a recording, or a scene in SocNav2's JSON format, of which some things cannot be known.

    docs/metrics.md defines every measure. One that has no meaning in the episode is nan, in the JSON file null.
    """

    file: tyro.conf.Positional[Path]
    """File that RecordTrajectory wrote, or a SocNav2 JSON file with robot poses."""
    output: Output = None
    """JSON file to write the measures to as well."""
    weights: str | None = None
    """Score the steps anew with these weights: default, published or a checkpoint folder."""
    without_robot: bool = False
    """Simulate a recording again without its robot, for person_detour and person_delay."""
    robot_radius: float = RobotConfig.radius
    """[m] of the robot in a SocNav2 file, which does not say it."""
    people_radius: float = PeopleConfig.radius
    """[m] of people in a SocNav2 file, which does not say it."""

    def run(self) -> int:
        """Read, measure, print one line a measure, and write them where asked to."""
        for name in ("robot_radius", "people_radius"):
            radius = getattr(self, name)
            if not (math.isfinite(radius) and radius > 0):
                raise ValueError(f"{name} must be a positive number, got {radius}")
        from socnav_env.recording.measure import measure_recording, measure_scene

        if _is_recording(self.file):
            measured = measure_recording(self.file, self.weights, self.without_robot)
        elif self.without_robot:
            raise ValueError(f"{self.file}: without_robot needs a recording, a SocNav2 file cannot be simulated again")
        else:
            measured = measure_scene(self.file, self.weights, self.robot_radius, self.people_radius)
        for name, value in measured.metrics.items():
            print(f"{name:28}{value:.6g}")
        if self.output is not None:
            values = {name: None if math.isnan(value) else value for name, value in measured.metrics.items()}
            document = {"file": str(self.file), "scorer": measured.scorer, "metrics": values}
            replace_file(self.output, (json.dumps(document, indent=2, allow_nan=False) + "\n").encode())
        return 0


@dataclass(frozen=True)
class Export:
    """Write a recording, warm-up included, as a scene in SocNav2's JSON format, as the reward model reads it."""

    file: tyro.conf.Positional[Path]
    """File that RecordTrajectory wrote."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """JSON file to write."""

    def run(self) -> int:
        """Read, simulate again, write."""
        from reward_model.scenes.socnav2_json import write_socnav2
        from socnav_env.recording.files import read_recording
        from socnav_env.recording.replay import recorded_sequence

        sequence = recorded_sequence(read_recording(self.file), self.file.stem)
        write_socnav2(sequence, self.output)
        print(f"{self.output}: {len(sequence)} snapshots")
        return 0


@dataclass(frozen=True)
class Config:
    """Print every key of the environment's configuration: its default, unit and meaning."""

    json: bool = False
    """Print the defaults as JSON instead, which --env-config of other commands reads."""

    def run(self) -> int:
        """Print them."""
        from socnav_env.config.reference import entries

        config = EnvConfig()
        if self.json:
            print(json.dumps(config.to_dict(), indent=2))
            return 0
        for entry in entries(config):
            print(f"{entry.key} = {entry.default}\n    {entry.meaning}")
        return 0


@dataclass(frozen=True)
class Scenarios:
    """List the scenarios that ship: their names and what happens in them."""

    def run(self) -> int:
        """Print one line each."""
        from socnav_env.scenarios import load_scenario, names

        for name in names():
            print(f"{name:28}{' '.join(load_scenario(name).description.split())}")
        return 0


@dataclass(frozen=True)
class Generate:
    """Simulate sequences like those of SocNav2, 35 snapshots of 4 s each, into a folder of JSON files and a manifest.

    The same whatever the number of jobs. A run that was broken off is completed by the same command.
    """

    num_sequences: int
    """How many there shall be in the folder."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """Folder; it may hold sequences of an earlier run with the same seed."""
    seed: int = 0
    """Seed of all sequences."""
    jobs: int = 2
    """Processes that share the work."""
    backend: str = "loky"
    """joblib's backend: loky for processes on this machine, ray for a cluster."""
    address: str | None = None
    """Address of a Ray cluster; without one, backend ray starts its own on this machine."""

    def run(self) -> int:
        """Simulate and write what is missing; print how many that were."""
        check_least(self, num_sequences=1, jobs=1, seed=0)
        from reward_model.base.progress import progress_bars
        from socnav_env.simulated_data.files import GenerationError, generate_sequences

        with progress_bars() as progress:
            task = progress.add_task("simulating", total=self.num_sequences)
            try:
                made = generate_sequences(
                    self.output,
                    self.num_sequences,
                    self.seed,
                    self.jobs,
                    self.backend,
                    self.address,
                    lambda count: progress.advance(task, count),
                )
            except GenerationError as error:
                print_error(PROGRAM, error)
                return BROKEN_OFF
        print(f"{self.output}: {made} new sequences, {self.num_sequences} in all")
        return 0


COMMANDS: Final[Mapping[str, type[Command]]] = {
    "render": Render,
    "play": Play,
    "replay": Replay,
    "metrics": Metrics,
    "export": Export,
    "scenarios": Scenarios,
    "config": Config,
    "generate": Generate,
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status: 0, 2 for bad input, 130 when interrupted, or one of its own."""
    return run_command(PROGRAM, COMMANDS, arguments)


def _is_recording(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(len(ZIP_START)) == ZIP_START


def _reported(path: Path) -> int:
    """Replay a file, say how it went, and return the exit status that it alone would give."""
    from socnav_env.recording.files import read_recording
    from socnav_env.recording.replay import first_difference, replay

    try:
        recording = read_recording(path)
        difference = first_difference(recording.trajectory, replay(recording))
    except ValueError as error:
        print_error(PROGRAM, error)
        return USER_ERROR
    steps = len(recording.trajectory)
    print(f"{path}: identical, {steps} steps" if difference is None else f"{path}: {difference}", flush=True)
    return 0 if difference is None else DIFFERENT
