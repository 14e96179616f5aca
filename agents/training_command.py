"""The command line of `train_agent.py`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import tyro
from rich.console import Console

from agents.config import PPOConfig, RunConfig
from agents.errors import AgentError
from agents.files import read_object
from reward_model.base.commands import INTERRUPTED, exit_status

FIXED = (
    "reward",
    "weights",
    "num_envs",
    "action_repeat",
    "seed",
    "environment",
    "scenario",
    "ppo",
)  # a resumed run cannot change these


@dataclass(frozen=True)
class Options:
    """Train a PPO agent in SocNav2-v0, evaluate it beside the baselines and save everything in a folder.

    Without options it takes about ten minutes on two cores. A run that was stopped or killed continues
    with --resume; its options are then remembered.
    """

    total_timesteps: int = RunConfig.total_timesteps
    """Control steps to train for, all environments together."""
    reward: str = RunConfig.reward
    """Reward to train with: learned, q1, q2, crowdnav, dsrnn, sparse, or a mix such as learned+0.5*crowdnav."""
    num_envs: int = RunConfig.num_envs
    """Environments that run side by side."""
    seed: int = RunConfig.seed
    """Seed of the networks, the exploration and the episodes."""
    output_dir: Path | None = None
    """Folder for everything the run writes; by default the first free runs/ppo-REWARD-NUMBER."""
    resume: Path | None = None
    """Folder of a run to continue from its last checkpoint."""
    eval_episodes: int = RunConfig.eval_episodes
    """Episodes of the evaluation at the end."""
    action_repeat: int = RunConfig.action_repeat
    """Control steps that an action lasts in training; trained agents act anew in each."""
    num_workers: int = RunConfig.num_workers
    """Processes that simulate; 0 simulates in this one."""
    weights: str = RunConfig.weights
    """Weights of the learned reward: default, published or a path."""
    env_config: Path | None = None
    """JSON file with the environment's configuration, where it differs from the default."""
    scenario: str | None = RunConfig.scenario
    """Where episodes begin: a scenario's name or file; without one in rooms drawn at random."""
    evaluation_interval: int = RunConfig.evaluation_interval
    """Timesteps between two evaluations during training."""
    evaluation_episodes: int = RunConfig.evaluation_episodes
    """Episodes of each evaluation during training."""
    checkpoint_interval: int = RunConfig.checkpoint_interval
    """Timesteps between two checkpoints."""
    ppo: PPOConfig = field(default_factory=PPOConfig)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit status: 0, 2 for bad input, 130 if the user stopped it."""

    def train() -> int:
        config, folder = _prepare(arguments)
        from agents.run import environment_maker, run

        return 0 if run(config, folder, environment_maker(config), Console()) else INTERRUPTED

    return exit_status("python train_agent.py", train)


def _prepare(arguments: Sequence[str] | None) -> tuple[RunConfig, Path]:
    """Return the run's config and folder. Raises `AgentError` on bad input, before anything is written."""
    options = tyro.cli(Options, args=arguments)
    from agents.run import check_environment, new_folder, read_run

    if options.resume is None:
        config = _config(options, {} if options.env_config is None else read_object(options.env_config))
        check_environment(config)
        return config, new_folder(config, options.output_dir)
    if options.output_dir is not None:
        raise AgentError("give either --output-dir for a new run or --resume for an earlier one, not both")
    stored = read_run(options.resume)
    options = tyro.cli(Options, args=arguments, default=_options(stored))
    environment = stored.environment if options.env_config is None else read_object(options.env_config)
    config = _config(options, environment)
    for name in FIXED:
        if getattr(config, name) != getattr(stored, name):
            raise AgentError(
                f"{options.resume}: its {name} is {getattr(stored, name)!r} and cannot become "
                f"{getattr(config, name)!r}; start a new run for that"
            )
    check_environment(config)
    return config, Path(str(options.resume))


def _config(options: Options, environment: dict[str, object]) -> RunConfig:
    return RunConfig(
        environment=environment,
        **{name: getattr(options, name) for name in RunConfig.__dataclass_fields__ if name != "environment"},
    )


def _options(config: RunConfig) -> Options:
    return replace(
        Options(),
        **{name: getattr(config, name) for name in RunConfig.__dataclass_fields__ if name != "environment"},
    )
