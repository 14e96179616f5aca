"""Scores of a fast robot in real and in slowed time: `python -m benchmarks.time_scale`.

Drivers of `socnav_env.simulated_data` that wait for people, that ignore them and that drive at them cross the same
rooms, until they arrive, touch something or have driven for `--seconds`. Every step is scored twice: as it is (`real`),
and slowed by the robot's `rated_time_scale` (`slowed`). Three settings:

- defaults: a robot of `--speed` and `--turn-rate` among the people of the default configuration
- pedestrians: the same robot among people as fast as in the street
- sped up: the robot that people rated, at its own speeds, among the default people. `slowed` is its episode as it is,
  `real` the same episode played faster by the other settings' factor. All that differs between the two is the pace.

With `--data` also two of real walks: hotel and zara01, of ETH and UCY. Every walk of 4.8 s and over 2 m is driven by a
robot twice: as it was walked, and straight to the exit as `benchmarks.realism` has it, without regard for anyone. Each
is slowed by its own top speed. A room of 10 m is drawn around it; companions count as any other people.

An episode is impolite if the robot touches a person, or if it comes closer than 0.45 m to one, between surfaces. The
figures say how well an episode's score, its lowest or its mean Q1, tells these from the others: the AUC, which is the
chance that an impolite episode scores below one that is not, in real and in slowed time. Their difference is given as
the 95 % interval of a bootstrap over episodes, taken as independent and the same for both times. `polite` is the mean
score of the episodes that are not impolite, in both times.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from rich.console import Console
from rich.table import Table
from scipy.stats import rankdata

from benchmarks.realism.crowd_replay import TOUCH, between_rows, real_walker, straight_walker
from benchmarks.realism.tracks import Walks, read_tracks, walks_of
from benchmarks.walk_scenes import EVERY, SPAN, walk_scene, windows_of
from reward_model.base.arrays import BoolArray, FloatArray
from reward_model.base.commands import check_least, run_command
from reward_model.base.files import replace_file
from reward_model.base.progress import watched
from reward_model.scenes.time_scale import slowed
from reward_model.scorer import SocialScorer, load_scorer
from socnav_env.config import EnvConfig, PeopleConfig, RobotConfig
from socnav_env.config.robot import RATED_SPEED
from socnav_env.episode import STANDING
from socnav_env.scenes.population import sample_layout
from socnav_env.simulated_data.drivers import DRIVERS
from socnav_env.simulation.snapshots import Recorder, frames_per_window
from socnav_env.simulation.world import World
from socnav_env.trajectories.outcomes import decide_outcome

DROVE = ("polite", "goal", "chaser")  # names of drivers
CLOSE = 0.45  # m between surfaces
WALKED = ("hotel", "zara01")  # recordings
LEAST_WAY = 2.0  # m from start to end of a real walk
RESAMPLES = 1000


class Setting(NamedTuple):
    """A configuration, and the time scales of `real` and of `slowed`."""

    config: EnvConfig
    time_scales: tuple[float, float]


class Episodes(NamedTuple):
    """Episodes of a setting.

    Attributes:
        touched, close: (num_episodes,) whether the robot touched a person, and came closer than `CLOSE` to one
        lowest, mean: (num_episodes, 2) of Q1, in real and in slowed time
    """

    touched: BoolArray
    close: BoolArray
    lowest: FloatArray
    mean: FloatArray


class Separation(NamedTuple):
    """One row of the table.

    Attributes:
        real, slowed: AUC
        low, high: interval of their difference
        polite_real, polite_slowed: mean score of the episodes that are not impolite
    """

    setting: str
    impolite: str
    score: str
    num_impolite: int
    num_episodes: int
    real: float
    slowed: float
    low: float
    high: float
    polite_real: float
    polite_slowed: float


@dataclass(frozen=True)
class TimeScale:
    """The robot, and how many episodes of it are scored."""

    weights: str = "default"
    """default (what ships), published (after import-published) or a checkpoint folder."""
    speed: float = 1.0
    """Top speed of the robot, forwards and backwards [m/s]."""
    turn_rate: float = 1.0
    """Top turn rate of the robot [rad/s]."""
    episodes: int = 200
    """Episodes of each driver in each setting."""
    seconds: float = 20.0
    """The longest episode."""
    seed: int = 0
    """Seed of rooms, people and drivers."""
    data: Path | None = None
    """Folder with hotel.txt and zara01.txt, as of `benchmarks.realism`."""
    quick: bool = False
    """A few short episodes, as a test and not as a measurement."""
    output: Path | None = None
    """A JSON file for the figures."""

    def run(self) -> None:
        """Simulate, score, print and write."""
        check_least(self, episodes=1, seed=0)
        torch.set_num_threads(1)
        found = settings(self)
        scorer, rows = load_scorer(self.weights), []
        count = 2 if self.quick else self.episodes
        for name in () if self.data is None else WALKED:
            walks = walks_of(read_tracks(self.data / f"{name}.txt"))
            rows += separations(name, _walked(walks, scorer, name))
        for name, setting in found.items():
            plans = [(self.seed, index, driver) for driver in DROVE for index in range(count)]
            rows += separations(name, _episodes(setting, scorer, [*watched(plans, name)]))
        factor = found["defaults"].config.robot.rated_time_scale
        Console().print(_table(f"AUC of Q1, {scorer.name} weights, slowed {factor:.2f} times", rows))
        if self.output is not None:
            document = [
                {name: None if value != value else value for name, value in row._asdict().items()} for row in rows
            ]
            replace_file(self.output, (json.dumps(document, indent=2, allow_nan=False) + "\n").encode())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    return run_command("python -m benchmarks.time_scale", TimeScale, arguments, __doc__)


def settings(options: TimeScale) -> dict[str, Setting]:
    """The three settings by name; see the module."""
    robot = RobotConfig(
        max_forward_speed=options.speed, max_backward_speed=options.speed, max_turn_rate=options.turn_rate
    )
    factor, seconds = robot.rated_time_scale, 2.0 if options.quick else options.seconds
    defaults = EnvConfig(time_limit=seconds, robot=robot)
    period = defaults.control_period
    # As long when it is played faster, and after a warm-up that fills the faster window.
    rated = EnvConfig(
        time_limit=round(factor * seconds / period) * period, warm_up=frames_per_window(period / factor) * period
    )
    return {
        "defaults": Setting(defaults, (1.0, factor)),
        "pedestrians": Setting(replace(defaults, people=PeopleConfig.pedestrians()), (1.0, factor)),
        "sped up": Setting(rated, (1 / factor, 1.0)),
    }


def _episodes(setting: Setting, scorer: SocialScorer, plans: Sequence[tuple[int, int, str]]) -> Episodes:
    """Simulate and score an episode for each seed, index and driver."""
    columns = zip(*(_episode(setting, scorer, *plan) for plan in plans), strict=True)
    return Episodes(*(np.array(column) for column in columns))


def _episode(
    setting: Setting, scorer: SocialScorer, seed: int, index: int, driver: str
) -> tuple[bool, bool, FloatArray, FloatArray]:
    """One row of `Episodes`. Rooms depend on the index, not on the driver."""
    config, rng = setting.config, np.random.default_rng([seed, index])
    world = World(sample_layout(config, rng), config, rng)
    recorders = [Recorder(world, config.control_period, time_scale) for time_scale in setting.time_scales]
    driving = np.random.default_rng([seed, index, 1])
    drives, close, scores = DRIVERS[driver](driving), False, []
    for step in range(-config.warm_up_steps, config.max_steps):
        world.advance(STANDING if step < 0 else drives.command(world, driving))
        for recorder in recorders:
            recorder.record()
        if step < 0:
            continue
        close |= bool((world.clearance_to_people() < CLOSE).any())
        scores.append(scorer.score_windows([recorder.window() for recorder in recorders])[:, 0])
        if decide_outcome(world, steps_left=1) is not None:
            break
    return world.contacts.person, close, np.min(scores, axis=0), np.mean(scores, axis=0)


def _walked(walks: Walks, scorer: SocialScorer, name: str) -> Episodes:
    """Score real walks, and straight ones from the same starts."""
    others = between_rows(walks.others)
    far = np.linalg.norm(walks.paths[:, -1] - walks.paths[:, 0], axis=1) > LEAST_WAY
    rows = []
    for paths in (real_walker(walks), straight_walker(walks, "exit")):
        for walk in watched(np.flatnonzero(far).tolist(), name):
            scene = walk_scene(paths[walk], others[walk], walks.exits[walk])
            top_speed = max(snapshot.command[0] for snapshot in scene)
            scales = (1.0, max(1.0, top_speed / RATED_SPEED))
            q1 = np.column_stack([scorer.score_windows(windows_of(slowed(scene, each)))[:, 0] for each in scales])
            apart = np.linalg.norm(others[walk] - paths[walk], axis=2)[:, (SPAN + 1) * EVERY :]
            nearest = np.min(apart, where=~np.isnan(apart), initial=np.inf)
            rows.append((nearest < TOUCH, nearest < TOUCH + CLOSE, q1.min(axis=0), q1.mean(axis=0)))
    return Episodes(*(np.array(column) for column in zip(*rows, strict=True)))


def separations(name: str, episodes: Episodes) -> list[Separation]:
    """The rows of a setting: two definitions of impolite, two scores of an episode."""
    rows = []
    for label, impolite in (("touched", episodes.touched), (f"{CLOSE} m", episodes.close)):
        for score, values in (("lowest", episodes.lowest), ("mean", episodes.mean)):
            real, slowed = (auc(values[:, column], impolite) for column in (0, 1))
            low, high = _interval(values, impolite)
            counts = int(impolite.sum()), len(impolite)
            others = values[~impolite].mean(axis=0).tolist() if counts[0] < counts[1] else (np.nan, np.nan)
            rows.append(Separation(name, label, score, *counts, real, slowed, low, high, *others))
    return rows


def auc(scores: FloatArray, impolite: BoolArray) -> float:
    """The chance that an impolite episode scores below another one, ties counting half; NaN without one of the two."""
    first, second = int(impolite.sum()), int((~impolite).sum())
    if not (first and second):
        return np.nan
    above = rankdata(scores)[~impolite].sum() - second * (second + 1) / 2
    return float(above / (first * second))


def _interval(values: FloatArray, impolite: BoolArray) -> tuple[float, float]:
    """95 % of the difference of the AUCs of slowed and real time."""
    rng, differences = np.random.default_rng(0), []
    for _ in range(RESAMPLES):
        chosen = rng.integers(len(impolite), size=len(impolite))
        real, slowed = (auc(values[chosen, column], impolite[chosen]) for column in (0, 1))
        differences.append(slowed - real)
    found = np.array(differences)[~np.isnan(differences)]
    low, high = np.percentile(found, (2.5, 97.5)) if len(found) else (np.nan, np.nan)
    return float(low), float(high)


def _table(title: str, rows: Sequence[Separation]) -> Table:
    table = Table(title=title, box=None, pad_edge=False)
    for heading in ("setting", "impolite", "Q1", "number", "real", "slowed", "difference", "polite"):
        table.add_column(heading, justify="left" if heading in ("setting", "impolite", "Q1") else "right")
    for row in rows:
        aucs = (f"{row.real:.3f}", f"{row.slowed:.3f}")
        counts = f"{row.num_impolite}/{row.num_episodes}"
        interval = f"{row.low:+.3f} {row.high:+.3f}"
        polite = f"{row.polite_real:.2f} {row.polite_slowed:.2f}"
        table.add_row(row.setting, row.impolite, row.score, counts, *aucs, interval, polite)
    return table


if __name__ == "__main__":
    sys.exit(main())
