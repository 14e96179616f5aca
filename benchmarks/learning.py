"""Speed of PPO's collecting and learning with the defaults of `train_agent.py`."""

from __future__ import annotations

import time
from typing import Final

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger

from agents.config import PPOConfig, RunConfig
from agents.envs import SocNavMaker, make_training_envs
from agents.ppo import THREADS, build_model
from benchmarks.figures import Figure

LEARNING: Final = "PPO"
METHODS: Final = {
    LEARNING: "control steps a second of an update, collecting and learning, with train_agent.py's defaults and the "
    "learned reward; a control step is a step of the environment"
}
QUICK = RunConfig(num_envs=4, num_workers=0, ppo=PPOConfig(n_steps=8, n_epochs=1))


def learning_rates(updates: int, quick: bool) -> list[Figure]:
    """Control steps a second of whole updates, and of collecting and learning alone."""
    config = QUICK if quick else RunConfig()
    threads = torch.get_num_threads()
    torch.set_num_threads(THREADS)
    envs = make_training_envs(SocNavMaker(config.reward), config.num_envs, config.num_workers, config.action_repeat)
    try:
        model = build_model(config, envs, config.seed)
        model.set_logger(Logger(None, []))
        clock = _Clock()
        actions = config.ppo.n_steps * config.num_envs
        model.learn(actions * (updates + 1), clock)  # the first update warms up
    finally:
        envs.close()
        torch.set_num_threads(threads)
    steps = actions * config.action_repeat
    halves = list(zip(clock.collecting, clock.learning, strict=True))[1:]
    name = f"{config.num_envs} worlds, {max(1, config.num_workers)} processes"
    return [
        Figure(LEARNING, f"{name}, collecting and learning", "1/s", [steps / sum(each) for each in halves]),
        Figure(LEARNING, f"{name}, collecting alone", "1/s", [steps / collecting for collecting, _ in halves]),
        Figure(LEARNING, f"{name}, learning alone", "1/s", [steps / learning for _, learning in halves]),
    ]


class _Clock(BaseCallback):
    """Records the seconds of each update's collecting and learning."""

    model: PPO

    def __init__(self) -> None:
        super().__init__()
        self.collecting: list[float] = []
        self.learning: list[float] = []
        self._since = 0.0

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        if self.collecting:
            self.learning.append(time.perf_counter() - self._since)
        self._since = time.perf_counter()

    def _on_rollout_end(self) -> None:
        self.collecting.append(time.perf_counter() - self._since)
        self._since = time.perf_counter()

    def _on_training_end(self) -> None:
        self.learning.append(time.perf_counter() - self._since)
