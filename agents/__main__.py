"""`python -m agents evaluate AGENT`: plays an agent over fixed seeds and writes what came of it."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import tyro
from rich.console import Console

from agents.config import RunConfig
from agents.files import read_object
from reward_model.base.commands import Command, check_least, run_command


@dataclass(frozen=True)
class EvaluateAgent:
    """Play an agent over fixed seeds; print and write its measures with 95 % bootstrap intervals."""

    agent: tyro.conf.Positional[str]
    """random, straight, an agent that ships with the package, a run's folder or an agent's file."""
    episodes: int = 100
    """How many episodes; the seeds are always the same."""
    output: Path | None = None
    """JSON file for every episode and the summary."""
    reward: str = "learned"
    """Reward whose return is reported."""
    weights: str = "default"
    """Weights of the learned reward."""
    env_config: Path | None = None
    """JSON file with the environment's configuration, where it differs from the default."""
    scenario: str | None = None
    """Where episodes begin: a scenario's name or file; without one in rooms drawn at random."""
    jobs: int = 2
    """Processes that share the episodes; the result is the same for any number."""

    def run(self) -> None:
        """Play all episodes, print the summary and write it where asked to."""
        from agents.evaluation import evaluate, evaluation_seeds
        from agents.policy import load_agent
        from agents.report import evaluation_table
        from agents.run import check_environment, environment_maker, environment_settings, write_evaluations

        check_least(self, episodes=1, jobs=1)
        environment = read_object(self.env_config) if self.env_config else {}
        config = RunConfig(reward=self.reward, weights=self.weights, scenario=self.scenario, environment=environment)
        policy = load_agent(self.agent)
        check_environment(config)
        console = Console()
        with console.status(f"evaluating {self.agent} over {self.episodes} episodes"):
            result = evaluate(policy, environment_maker(config), evaluation_seeds(self.episodes), self.jobs)
        console.print(evaluation_table({self.agent: result}))
        if self.output is not None:
            write_evaluations({self.agent: result}, environment_settings(config), self.output)


COMMANDS: Final[Mapping[str, type[Command]]] = {"evaluate": EvaluateAgent}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status: 0, 2 for bad input, 130 when interrupted."""
    return run_command("python -m agents", COMMANDS, arguments)


if __name__ == "__main__":
    sys.exit(main())
