"""One training run from its folder to its report; `train_agent.py` parses and calls this."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from agents.config import RunConfig
from agents.envs import EnvironmentMaker, SocNavMaker
from agents.evaluation import Evaluation, evaluate, evaluation_seeds
from agents.policy_files import AGENT_FILE, load_agent, load_policy
from agents.ppo import train
from agents.report import evaluation_table, film_episode, plot_learning_curve
from agents.storage import AgentError, read_object, write_json

RUNS_FOLDER = Path("runs")
CONFIG_FILE = "config.json"
EVALUATION_FILE = "eval.json"
CURVE_FILE = "learning_curve.png"
FILM_FILE = "episode.gif"
COMPARED = ("random", "straight")  # baselines evaluated beside the trained agent


def check_environment(config: RunConfig) -> None:
    """Raise `AgentError` in one line if the environment cannot be made, before anything is written."""
    try:
        environment_maker(config)().close()
    except (ValueError, OSError) as error:
        raise AgentError(str(error)) from error


def environment_maker(config: RunConfig) -> SocNavMaker:
    """Return what makes the environments of a run."""
    return SocNavMaker(config.reward, config.weights, config.environment, config.scenario)


def read_run(folder: Path) -> RunConfig:
    """Return the config of the run in `folder`. Raises `AgentError` if there is none."""
    path = folder / CONFIG_FILE
    if not path.is_file():
        raise AgentError(f"{folder}: is no training run: it has no {CONFIG_FILE}; give the folder of an earlier run")
    return RunConfig.from_dict(read_object(path), str(path))


def new_folder(config: RunConfig, wanted: Path | None) -> Path:
    """Return the folder of a new run: the one that is wanted, or the first free number under `runs`.

    Raises:
        AgentError: If the folder already has a run.
    """
    if wanted is not None:
        if (wanted / CONFIG_FILE).exists():
            raise AgentError(f"{wanted}: already holds a run; continue it with --resume {wanted} or choose another")
        return wanted
    number, name = 1, config.reward.replace("*", "x")  # of a mix
    while (RUNS_FOLDER / f"ppo-{name}-{number}").exists():
        number += 1
    return RUNS_FOLDER / f"ppo-{name}-{number}"


def run(config: RunConfig, folder: Path, make: EnvironmentMaker, console: Console) -> bool:
    """Train, evaluate beside the baselines and report, all into `folder`.

    Returns:
        Whether it ran to the end; False if the user stopped the training.
    """
    folder.mkdir(parents=True, exist_ok=True)
    write_json(folder / CONFIG_FILE, config.to_dict())
    console.print(f"training with reward {config.reward} into {folder}")
    history = train(config, make, folder, console)
    if history is None:
        console.print(f"stopped; continue with: python train_agent.py --resume {folder}")
        return False
    plot_learning_curve(history, f"PPO, reward {config.reward}, seed {config.seed}", folder / CURVE_FILE)
    evaluations = evaluate_beside_baselines(config, make, folder, console)
    console.print(evaluation_table(evaluations))
    film_episode(load_policy(folder / AGENT_FILE), make, worth_watching(evaluations["ppo"]), folder / FILM_FILE)
    console.print(f"written to {folder}: {AGENT_FILE}, {EVALUATION_FILE}, {CURVE_FILE}, {FILM_FILE}")
    return True


def evaluate_beside_baselines(
    config: RunConfig, make: EnvironmentMaker, folder: Path, console: Console
) -> dict[str, Evaluation]:
    """Evaluate the trained agent and the baselines on the same episodes and write `eval.json`."""
    seeds = evaluation_seeds(config.eval_episodes)
    agents = {"ppo": load_policy(folder / AGENT_FILE)} | {name: load_agent(name) for name in COMPARED}
    evaluations = {}
    for name, policy in agents.items():
        with console.status(f"evaluating {name} over {len(seeds)} episodes"):
            evaluations[name] = evaluate(policy, make, seeds, max(1, config.num_workers))
    write_evaluations(evaluations, environment_settings(config), folder / EVALUATION_FILE)
    return evaluations


def worth_watching(evaluation: Evaluation) -> int:
    """Return the seed of the longest episode in which the agent arrived, or of the longest of all if it never did."""
    longest = max(evaluation.episodes, key=lambda episode: (episode.outcome == "arrived", episode.length))
    return longest.seed


def environment_settings(config: RunConfig) -> dict[str, object]:
    """Return what an evaluation file says about the environment."""
    return {name: getattr(config, name) for name in ("reward", "weights", "environment", "scenario")}


def write_evaluations(evaluations: dict[str, Evaluation], settings: dict[str, object], path: Path) -> None:
    """Write evaluations by agent, with the settings they were made under, as JSON."""
    write_json(path, {**settings, "agents": {name: item.to_dict() for name, item in evaluations.items()}})
