"""Policies that try to be paid without doing the task: `python -m benchmarks.reward_hacking`.

Hand-written exploits (`benchmarks/exploits`) and two references that drive to the goal play the same episodes. A policy
is a hole where its mean discounted return is above that of the planner that arrives, or where it crashes and its return
is above that of standing to the end. Scores are also those of the published network, where it has been imported, and
of synthetic scenes that nobody rated. docs/reward_hacking.md explains the findings.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import torch
from rich.console import Console
from rich.table import Table as RichTable

from benchmarks.exploits import EXPLOITS
from benchmarks.exploits.playing import play
from benchmarks.exploits.report import Row, Table, document, extremes, holes_of, row_of, tables
from reward_model.base.commands import check_least, run_command
from reward_model.base.files import replace_file
from reward_model.base.progress import watched
from reward_model.networks.checkpoint import CheckpointError
from reward_model.scorer import load_scorer, weights_path
from socnav_env.commands.pictures import read_env_config
from socnav_env.config import EnvConfig
from socnav_env.env import SocNavEnv
from socnav_env.rewards import Scorer, shared_scorer

PUBLISHED = "published"
SEED = 3_000_000  # the first seed, far from those of training and of the evaluations of agents


@dataclass(frozen=True)
class RewardHacking:
    """The reward to try, and for how many episodes."""

    reward: str = "learned"
    """Reward by name, or a mix such as learned+0.5*crowdnav."""
    weights: str = "default"
    """Weights under test: default, published or a path."""
    env_config: Path | None = None
    """JSON file with the environment's configuration, where it differs from the default."""
    episodes: int = 30
    """Episodes of each policy."""
    seed: int = SEED
    """Seed of the first episode; the next ones count on."""
    only: tuple[str, ...] = ()
    """Names of policies, all by default; `stand` and `planner` are always played."""
    output_format: Literal["table", "markdown"] = "table"
    """How the tables are printed."""
    output: Path | None = None
    """A JSON file for the findings."""

    def run(self) -> None:
        """Play, print and write."""
        check_least(self, episodes=1, seed=0)
        names = _chosen(self.only)
        torch.set_num_threads(1)
        config = EnvConfig() if self.env_config is None else read_env_config(self.env_config)
        # `graph` reads the frames, so that they are kept for scorers with any reward.
        env = SocNavEnv(self.reward, "graph", config, weights=self.weights)
        scorers = _scorers(self.weights)
        rows = self._play(env, names, scorers)
        odd = extremes(scorers)
        holes = holes_of(rows)
        for table in tables(rows, holes, odd):
            _print(table, self.output_format)
        if self.output is not None:
            found = {"reward": self.reward, "weights": self.weights, "config": config.to_dict()["reward"]}
            found |= document(rows, holes, odd)
            replace_file(self.output, (json.dumps(found, indent=1) + "\n").encode())

    def _play(self, env: SocNavEnv, names: Sequence[str], scorers: dict[str, Scorer]) -> list[Row]:
        seeds = range(self.seed, self.seed + self.episodes)
        rows = []
        for name in watched(names, "playing"):
            _, new_policy = EXPLOITS[name]
            episodes = [play(env, new_policy, seed, scorers) for seed in seeds]
            rows.append(row_of(name, episodes, env.config.control_period))
        return rows


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    return run_command("python -m benchmarks.reward_hacking", RewardHacking, arguments, __doc__)


def _chosen(only: Sequence[str]) -> list[str]:
    if unknown := sorted(set(only) - set(EXPLOITS)):
        raise ValueError(f"only must name policies of {', '.join(EXPLOITS)}, got {', '.join(unknown)}")
    return [name for name in EXPLOITS if not only or name in (*only, "stand", "planner")]


def _scorers(weights: str) -> dict[str, Scorer]:
    """The network under test, and the published one where it is on this machine."""
    scorers: dict[str, Scorer] = {weights: shared_scorer(weights)}
    try:
        weights_path(PUBLISHED)
    except CheckpointError:
        return scorers
    return scorers | {PUBLISHED: load_scorer(PUBLISHED)}


def _print(table: Table, output_format: str) -> None:
    if output_format == "markdown":
        print(table.markdown())
        return
    shown = RichTable(title=table.title, title_justify="left", title_style="")
    for place, heading in enumerate(table.header):
        shown.add_column(heading, justify="right" if place else "left")
    for row in table.rows:
        shown.add_row(*row)
    Console().print(shown)


if __name__ == "__main__":
    sys.exit(main())
