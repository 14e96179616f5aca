"""Trains Stable-Baselines3's PPO and picks up a run where it was left."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from rich.console import Console
from stable_baselines3 import PPO
from stable_baselines3.common.logger import configure
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from agents.callbacks import StopRequest, TrainingCallback
from agents.checkpoint import CHECKPOINT_FILE, LearningHistory, load_checkpoint, save_checkpoint
from agents.config import PPOConfig, RunConfig
from agents.envs import EnvironmentMaker, make_training_envs
from agents.evaluation import SELECTION_SEEDS, Evaluation, evaluate, evaluation_seeds
from agents.features.policy import EntityPolicy, EntityRolloutBuffer
from agents.policy_files import AGENT_FILE, policy_arguments, save_policy

FINAL_LEARNING_RATE = 0.1  # share of the learning rate that is left at the end
TENSORBOARD_FOLDER = "tensorboard"
THREADS = 1  # these networks are small: a second thread mostly waits, and starves the workers where cores are shared


def train(config: RunConfig, make: EnvironmentMaker, folder: Path, console: Console) -> LearningHistory | None:
    """Train an agent, from the folder's checkpoint on where there is one.

    Writes the agent (`agent.safetensors`), the checkpoint and TensorBoard's logs to `folder`.

    Args:
        config: the run.
        make: makes an environment.
        folder: the run's output folder, which exists.
        console: where progress is shown.

    Returns:
        The learning curve, or None if the user stopped the training, whose state is saved in both cases.
    """
    torch.set_num_threads(THREADS)
    path = folder / CHECKPOINT_FILE
    checkpoint = load_checkpoint(path) if path.is_file() else None
    history = checkpoint.history if checkpoint else LearningHistory()
    trained = checkpoint.actions if checkpoint else 0
    wanted = -(-config.total_timesteps // config.action_repeat)  # actions, which is what SB3 counts
    if trained >= wanted:
        return history
    envs = make_training_envs(make, config.num_envs, config.num_workers, config.action_repeat)
    try:
        model = build_model(config, envs, run_seed(config.seed, trained))
        if checkpoint:
            checkpoint.restore(model)
        model.set_logger(configure(str(folder / TENSORBOARD_FOLDER), ["tensorboard"]))
        with StopRequest() as stop:
            callback = TrainingCallback(config, folder, history, _evaluator(config, make), stop, console)
            try:
                model.learn(wanted - trained, callback, reset_num_timesteps=False)
            finally:
                callback.close()
            save_checkpoint(path, model, history)
            save_policy(model.policy, architecture(config.ppo), folder / AGENT_FILE)
        return None if stop.made else history
    finally:
        envs.close()


def build_model(config: RunConfig, envs: VecEnv, seed: int) -> PPO:
    """Return an untrained PPO on `envs`, whose rewards it scales by the running deviation of the returns."""
    ppo = config.ppo
    return PPO(
        EntityPolicy,
        VecNormalize(envs, norm_obs=False, norm_reward=True, gamma=ppo.gamma),
        learning_rate=lambda left: ppo.learning_rate * (FINAL_LEARNING_RATE + (1 - FINAL_LEARNING_RATE) * left),
        n_steps=ppo.n_steps,
        batch_size=min(ppo.batch_size, ppo.n_steps * config.num_envs),
        n_epochs=ppo.n_epochs,
        gamma=ppo.gamma,
        gae_lambda=ppo.gae_lambda,
        clip_range=ppo.clip_range,
        ent_coef=ppo.ent_coef,
        vf_coef=ppo.vf_coef,
        max_grad_norm=ppo.max_grad_norm,
        rollout_buffer_class=EntityRolloutBuffer,
        policy_kwargs=policy_arguments(architecture(ppo)),
        seed=seed,
        device="cpu",
    )


def architecture(ppo: PPOConfig) -> dict[str, object]:
    """Return the sizes that `agents.policy_files` builds the network from."""
    return {
        "entity_width": ppo.entity_width,
        "net_arch": list(ppo.net_arch),
        "log_std_init": ppo.log_std_init,
    }


def run_seed(seed: int, trained: int) -> int:
    """Return a seed for the part of a run that starts after `trained` actions; no part repeats another's episodes."""
    return int(np.random.SeedSequence([seed, trained]).generate_state(1)[0] % 2**31)


def _evaluator(config: RunConfig, make: EnvironmentMaker) -> Callable[[PPO], Evaluation]:
    """Return what evaluates a model's policy, on the seeds set aside for the time of training."""
    seeds = evaluation_seeds(config.evaluation_episodes, SELECTION_SEEDS)
    jobs = max(1, config.num_workers)
    return lambda model: evaluate(model.policy, make, seeds, jobs)
