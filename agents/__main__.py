"""`python -m agents evaluate AGENT`: plays an agent over fixed seeds and writes what came of it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import tyro
from rich.console import Console

from agents.config import RunConfig
from agents.errors import AgentError
from agents.files import read_object

USER_ERROR = 2
INTERRUPTED = 130


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


COMMANDS: dict[str, Callable[..., EvaluateAgent]] = {"evaluate": EvaluateAgent}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status: 0, or 2 for bad input."""
    command = tyro.extras.subcommand_cli_from_dict(COMMANDS, prog="python -m agents", args=arguments)
    try:
        _evaluate(command)
    except AgentError as error:
        print(f"agents: {error}", file=sys.stderr)
        return USER_ERROR
    except KeyboardInterrupt:
        print("agents: interrupted", file=sys.stderr)
        return INTERRUPTED
    return 0


def _evaluate(command: EvaluateAgent) -> None:
    from agents.evaluation import evaluate, evaluation_seeds
    from agents.policy import load_agent
    from agents.report import evaluation_table
    from agents.run import check_environment, environment_maker, environment_settings, write_evaluations

    for name in ("episodes", "jobs"):
        if getattr(command, name) < 1:
            raise AgentError(f"{name} must be at least 1, got {getattr(command, name)}")
    environment = read_object(command.env_config) if command.env_config else {}
    config = RunConfig(
        reward=command.reward, weights=command.weights, scenario=command.scenario, environment=environment
    )
    policy = load_agent(command.agent)
    check_environment(config)
    console = Console()
    with console.status(f"evaluating {command.agent} over {command.episodes} episodes"):
        result = evaluate(policy, environment_maker(config), evaluation_seeds(command.episodes), command.jobs)
    console.print(evaluation_table({command.agent: result}))
    if command.output is not None:
        write_evaluations({command.agent: result}, environment_settings(config), command.output)


if __name__ == "__main__":
    sys.exit(main())
