"""Checkpoints of a training run: one safetensors file that holds all that is needed to go on. Nothing is pickled."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize
from torch import Tensor

from agents.policy_files import fill_network, network_tensors
from agents.storage import read_tensors, write_tensors

CHECKPOINT_FILE = "checkpoint.safetensors"
CHECKPOINT_LAYOUT = "socnav2-checkpoint-1"


@dataclass
class LearningHistory:
    """What the learning curve is drawn from.

    Attributes:
        training: one row an update: timesteps and the means of the latest episodes
        evaluations: one row an evaluation: timesteps, and by measure mean, low and high
    """

    training: list[dict[str, float]] = field(default_factory=list)
    evaluations: list[dict[str, Any]] = field(default_factory=list)


def save_checkpoint(path: Path, model: PPO, history: LearningHistory) -> None:
    """Write networks, optimizer, reward scale, timesteps and history of a run."""
    scale = _reward_scale(model).ret_rms
    progress = {
        "actions": model.num_timesteps,
        "updates": model._n_updates,
        "reward_scale": {"mean": float(scale.mean), "var": float(scale.var), "count": float(scale.count)},
        "history": {"training": history.training, "evaluations": history.evaluations},
    }
    tensors = {f"policy.{name}": tensor for name, tensor in network_tensors(model.policy).items()}
    for index, state in model.policy.optimizer.state_dict()["state"].items():
        tensors |= {f"optimizer.{index}.{name}": tensor.contiguous() for name, tensor in state.items()}
    write_tensors(path, CHECKPOINT_LAYOUT, tensors, progress)


def load_checkpoint(path: Path) -> RunCheckpoint:
    """Read what `save_checkpoint` wrote. Raises `AgentError` naming the file if it is anything else."""
    tensors, progress = read_tensors(path, CHECKPOINT_LAYOUT)
    return RunCheckpoint(path, tensors, progress, LearningHistory(**progress["history"]))


@dataclass(frozen=True, eq=False)
class RunCheckpoint:
    """A checkpoint in memory; `restore` puts it into a model of the same sizes."""

    path: Path
    tensors: dict[str, Tensor]
    progress: dict[str, Any]
    history: LearningHistory

    @property
    def actions(self) -> int:
        """Actions taken so far, all environments together; each lasts the run's `action_repeat` control steps."""
        return int(self.progress["actions"])

    def restore(self, model: PPO) -> None:
        """Put networks, optimizer, reward scale and timesteps into `model`."""
        fill_network(model.policy, self._part("policy."), self.path)
        optimizer = model.policy.optimizer.state_dict()
        for name, tensor in self._part("optimizer.").items():
            index, key = name.split(".")
            optimizer["state"].setdefault(int(index), {})[key] = tensor
        model.policy.optimizer.load_state_dict(optimizer)
        scale, stored = _reward_scale(model).ret_rms, self.progress["reward_scale"]
        scale.mean, scale.var = np.asarray(stored["mean"]), np.asarray(stored["var"])
        scale.count = stored["count"]
        model.num_timesteps = self.actions
        model._n_updates = int(self.progress["updates"])

    def _part(self, prefix: str) -> dict[str, Tensor]:
        return {name.removeprefix(prefix): tensor for name, tensor in self.tensors.items() if name.startswith(prefix)}


def _reward_scale(model: PPO) -> VecNormalize:
    scale = model.get_vec_normalize_env()
    assert scale is not None, "models are built with reward scaling"
    return scale
