"""Train a network on labelled windows: early stopping, deterministic by seed."""

from __future__ import annotations

import copy
from collections.abc import Callable
from collections.abc import Sequence as Items
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from reward_model.compiled import EdgelessMPNN
from reward_model.graph import Float32Array, FrameGraph
from reward_model.windows import pack_windows

_LEAK = 0.1  # slope below zero while training; a network that answers below zero could not learn its way back


@dataclass(frozen=True, eq=False)
class LabelledWindows:
    """Windows and what they were scored.

    windows: each one to three frames, newest first
    scores: (num_windows, 2) Q1 and Q2 in 0..1, NaN where a question was not asked
    """

    windows: Items[Items[FrameGraph]]
    scores: Float32Array

    def __len__(self) -> int:
        return len(self.windows)


@dataclass(frozen=True)
class TrainingConfig:
    """How to train.

    patience: epochs without a better development error before training stops
    """

    max_epochs: int = 60
    patience: int = 8
    batch_size: int = 64
    learning_rate: float = 2e-3
    weight_decay: float = 1e-6
    seed: int = 0
    device: str = "cpu"

    def __post_init__(self) -> None:
        for name in ("max_epochs", "patience", "batch_size", "learning_rate"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")


class Epoch(NamedTuple):
    """Mean squared errors after one pass over the training windows, the mean of Q1's and Q2's where both were asked."""

    number: int
    train_error: float
    development_error: float


def fit(
    network: EdgelessMPNN,
    train: LabelledWindows,
    development: LabelledWindows,
    config: TrainingConfig,
    after_epoch: Callable[[Epoch], None] = lambda epoch: None,
) -> list[Epoch]:
    """Train in place; the network ends with the weights of its best epoch on the development windows.

    The learning rate falls to a hundredth along a half cosine. Returns every epoch's errors.
    Raises `ValueError` where one of the two holds no score at all.
    """
    for name, data in (("train", train), ("development", development)):
        if np.isnan(data.scores).all():
            raise ValueError(f"the {name} windows must hold at least one score, got {len(data)} windows without any")
    generator = np.random.default_rng(config.seed)
    network.to(config.device).train()
    steps = config.max_epochs * -(-len(train) // config.batch_size)
    optimizer = torch.optim.AdamW(network.parameters(), lr=config.learning_rate, weight_decay=config.weight_decay)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, steps, config.learning_rate / 100)
    history: list[Epoch] = []
    best, best_state = float("inf"), copy.deepcopy(network.state_dict())
    for number in range(1, config.max_epochs + 1):
        train_error = _one_pass(network, train, generator.permutation(len(train)), config, optimizer, schedule)
        history.append(Epoch(number, train_error, float(np.nanmean(errors(network, development, config.device)))))
        after_epoch(history[-1])
        if history[-1].development_error < best:
            best, best_state = history[-1].development_error, copy.deepcopy(network.state_dict())
        elif number - min(history, key=lambda epoch: epoch.development_error).number >= config.patience:
            break
    network.load_state_dict(best_state)
    network.eval()
    return history


def errors(network: EdgelessMPNN, data: LabelledWindows, device: str = "cpu") -> Float32Array:
    """(2,) the mean squared errors of Q1 and Q2, NaN for a question that was never asked."""
    squares, counts = torch.zeros(2), torch.zeros(2)
    with torch.no_grad():
        for start in range(0, len(data), 256):
            chosen = np.arange(start, min(start + 256, len(data)))
            answers, scores = _answers(network, data, chosen, device)
            difference, known = _differences(torch.relu(answers), scores)
            squares += (difference**2).sum(dim=0).cpu()
            counts += known.sum(dim=0).cpu()
    result: Float32Array = (squares / counts).numpy()
    return result


def _one_pass(
    network: EdgelessMPNN,
    data: LabelledWindows,
    order: np.ndarray[tuple[int], np.dtype[np.int64]],
    config: TrainingConfig,
    optimizer: torch.optim.Optimizer,
    schedule: torch.optim.lr_scheduler.LRScheduler,
) -> float:
    total, count = 0.0, 0
    for start in range(0, len(order), config.batch_size):
        answers, scores = _answers(network, data, order[start : start + config.batch_size], config.device)
        difference, known = _differences(torch.nn.functional.leaky_relu(answers, _LEAK), scores)
        loss = (difference**2).sum() / known.sum().clamp(min=1)
        optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimizer.step()
        schedule.step()
        total, count = total + loss.item() * len(answers), count + len(answers)
    return total / count


def _answers(
    network: EdgelessMPNN, data: LabelledWindows, chosen: np.ndarray[tuple[int], np.dtype[np.int64]], device: str
) -> tuple[Tensor, Tensor]:
    batch = pack_windows([data.windows[index] for index in chosen.tolist()]).to(device)
    return network(batch), torch.from_numpy(data.scores[chosen]).to(device)


def _differences(answers: Tensor, scores: Tensor) -> tuple[Tensor, Tensor]:
    """What each answer is off by, 0 where there is no score, and where there is one."""
    known = ~scores.isnan()
    return torch.where(known, answers - scores, 0.0), known
