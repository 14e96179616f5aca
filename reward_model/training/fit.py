"""Training of a network on labelled windows: early stopping, deterministic by seed, resumable when interrupted."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
import torch
from torch import Tensor

from reward_model.base.arrays import Float32Array
from reward_model.data.labelled_windows import LabelledWindows, data_digest
from reward_model.networks.window_network import WindowNetwork
from reward_model.training.optimizers import Stepper, steppers
from reward_model.training.state import (
    TrainingState,
    generator_tensors,
    load_state,
    named,
    restore_generators,
    save_state,
    unnamed,
)

_Indices = np.ndarray[tuple[int], np.dtype[np.int64]]
_LEAK = 0.1  # slope below zero in training, since scores below zero would have no gradient


@dataclass(frozen=True)
class TrainingConfig:
    """Options of a training.

    Attributes:
        patience: epochs without a better development error before training stops
        optimizer: `adamw`, whose learning rate falls to a hundredth along a half cosine; or `muon` (Jordan et al.
            2024) for the matrices between hidden features, with AdamW for all else, whose rates rise in the first
            `WARM_UP` of the steps and then fall to nothing along a half cosine
        matrix_rate: the learning rate of muon
    """

    max_epochs: int = 60
    patience: int = 8
    batch_size: int = 64
    learning_rate: float = 2e-3
    weight_decay: float = 1e-6
    seed: int = 0
    device: str = "cpu"
    optimizer: Literal["adamw", "muon"] = "adamw"
    matrix_rate: float = 0.03

    def __post_init__(self) -> None:
        for name in ("max_epochs", "patience", "batch_size", "learning_rate", "matrix_rate"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")


class Epoch(NamedTuple):
    """Mean squared errors after one pass over the training windows, the mean of Q1 and Q2 where both have scores."""

    number: int
    train_error: float
    development_error: float


class DivergedError(ValueError):
    """A training diverged: none of its errors is a number."""


def best_epoch(history: Sequence[Epoch]) -> Epoch:
    """The first epoch with the smallest development error; NaN is the largest."""
    return min(history, key=lambda epoch: float(np.nan_to_num(epoch.development_error, nan=math.inf)))


def fit(
    network: WindowNetwork,
    train: LabelledWindows,
    development: LabelledWindows,
    config: TrainingConfig,
    after_epoch: Callable[[Epoch], None] = lambda epoch: None,
    state_file: Path | None = None,
    resume: bool = False,
) -> list[Epoch]:
    """Train in place; the network ends with the weights of its best epoch on the development windows.

    Args:
        after_epoch: called with every epoch after it is written to `state_file`; a resumed training first calls it with
            its earlier epochs
        state_file: written after every epoch; with `resume`, its training continues as if it had not been interrupted

    Returns:
        Every epoch's errors.

    Raises:
        ValueError: If one of the data sets has no score.
        DivergedError: If no error is a number.
        TrainingStateError: If `state_file` is not of this training.
    """
    for name, data in (("train", train), ("development", development)):
        if np.isnan(data.scores).all():
            raise ValueError(f"the {name} windows must hold at least one score, got {len(data)} windows without any")
    training = _Training(network, train, development, config)
    with torch.random.fork_rng():  # dropout draws from PyTorch's own generators
        torch.manual_seed(config.seed)
        if resume:
            if state_file is None:
                raise ValueError("resume needs the state_file of the training to go on with")
            training.restore(state_file)
            for epoch in training.history:
                after_epoch(epoch)
        while not training.is_over():
            training.run_epoch()
            if state_file is not None:
                training.save(state_file)
            after_epoch(training.history[-1])
    if math.isnan(training.best.development_error):
        raise DivergedError(
            f"training got out of hand, no error is a number; lower learning_rate {config.learning_rate}"
        )
    network.load_state_dict(training.best_state)
    network.eval()
    return training.history


def errors(network: WindowNetwork, data: LabelledWindows, device: str = "cpu") -> Float32Array:
    """Mean squared errors (2,) of Q1 and Q2, NaN for a question without scores."""
    squares, counts = torch.zeros(2), torch.zeros(2)
    for answers, scores in _answered(network, data, device):
        difference, known = _differences(answers, scores)
        squares += (difference**2).sum(dim=0).cpu()
        counts += known.sum(dim=0).cpu()
    result: Float32Array = (squares / counts).numpy()
    return result


def predicted(network: WindowNetwork, data: LabelledWindows, device: str = "cpu") -> Float32Array:
    """A network's scores (num_windows, 2), never below 0."""
    answers = [answers.cpu().numpy() for answers, _ in _answered(network, data, device)]
    result: Float32Array = np.concatenate([np.zeros((0, 2), dtype=np.float32), *answers])
    return result


def _answered(network: WindowNetwork, data: LabelledWindows, device: str) -> Iterator[tuple[Tensor, Tensor]]:
    """Predictions and labels, batch by batch, without dropout or gradients."""
    size = network.windows_at_once
    was_training = network.training
    network.eval()
    with torch.no_grad():
        for start in range(0, len(data), size):
            answers, scores = _answers(network, data, np.arange(start, min(start + size, len(data))), device)
            yield torch.relu(answers), scores
    network.train(was_training)


class _Training:
    """A network in training, epoch by epoch."""

    def __init__(
        self, network: WindowNetwork, train: LabelledWindows, development: LabelledWindows, config: TrainingConfig
    ) -> None:
        self.network, self.train, self.development, self.config = network, train, development, config
        self.generator = np.random.default_rng(config.seed)
        network.prepare(train.windows)
        network.to(config.device).train()
        self.steppers = steppers(network, config, config.max_epochs * -(-len(train) // config.batch_size))
        self.history: list[Epoch] = []
        self.best_state = copy.deepcopy(network.state_dict())

    @property
    def best(self) -> Epoch:
        return best_epoch(self.history)

    def is_over(self) -> bool:
        if not self.history:
            return False
        number = self.history[-1].number
        return number >= self.config.max_epochs or number - self.best.number >= self.config.patience

    def run_epoch(self) -> None:
        order = self.generator.permutation(len(self.train))
        train_error = _one_pass(self.network, self.train, order, self.config, self.steppers)
        asked = ~np.isnan(self.development.scores).all(axis=0)
        development_error = float(errors(self.network, self.development, self.config.device)[asked].mean())
        self.history.append(Epoch(len(self.history) + 1, train_error, development_error))
        if self.best is self.history[-1]:
            self.best_state = copy.deepcopy(self.network.state_dict())

    def save(self, path: Path) -> None:
        progress = {
            "generator": self.generator.bit_generator.state,
            "optimizers": [stepper.progress() for stepper in self.steppers],
            "history": self.history,
        }
        tensors = {
            **named("network", self.network.state_dict()),
            **named("best", self.best_state),
            **generator_tensors(),
        }
        for number, stepper in enumerate(self.steppers):
            tensors |= named(f"optimizer{number}", stepper.tensors())
        save_state(path, TrainingState(self._run(), progress, tensors))

    def restore(self, path: Path) -> None:
        state = load_state(path, self._run())
        self.network.load_state_dict(unnamed("network", state.tensors))
        self.best_state = unnamed("best", state.tensors)
        for number, (stepper, progress) in enumerate(zip(self.steppers, state.progress["optimizers"], strict=True)):
            stepper.restore(progress, unnamed(f"optimizer{number}", state.tensors))
        self.generator.bit_generator.state = state.progress["generator"]
        self.history = [Epoch(*epoch) for epoch in state.progress["history"]]
        restore_generators(state.tensors)

    def _run(self) -> dict[str, object]:
        """The data and options that identify this training."""
        shapes = {name: list(tensor.shape) for name, tensor in self.network.state_dict().items()}
        digests = {"train_data": data_digest(self.train), "development_data": data_digest(self.development)}
        return asdict(self.config) | digests | {"network": [type(self.network).__name__, shapes]}


def _one_pass(
    network: WindowNetwork,
    data: LabelledWindows,
    order: _Indices,
    config: TrainingConfig,
    steppers: Sequence[Stepper],
) -> float:
    total, count = 0.0, 0
    for start in range(0, len(order), config.batch_size):
        chosen = order[start : start + config.batch_size]
        answers = network.training_answers(data.windows_at(chosen), config.device)  # (members, batch, 2)
        scores = torch.from_numpy(data.scores[chosen]).to(config.device)
        difference, known = _differences(torch.nn.functional.leaky_relu(answers, _LEAK), scores)
        loss = _weighted_mean((difference**2).mean(dim=0), known, data, chosen)
        network.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        for stepper in steppers:
            stepper.step()
        total, count = total + loss.item() * len(chosen), count + len(chosen)
    return total / count


def _answers(network: WindowNetwork, data: LabelledWindows, chosen: _Indices, device: str) -> tuple[Tensor, Tensor]:
    answers = network.answers(data.windows_at(chosen), device)
    return answers, torch.from_numpy(data.scores[chosen]).to(device)


def _weighted_mean(squares: Tensor, known: Tensor, data: LabelledWindows, chosen: _Indices) -> Tensor:
    if data.weights is None:
        return squares.sum() / known.sum().clamp(min=1)
    weights = torch.from_numpy(data.weights[chosen]).to(squares.device)
    total = (weights * known).sum()
    return (weights * squares).sum() / torch.where(total > 0, total, 1.0)


def _differences(answers: Tensor, scores: Tensor) -> tuple[Tensor, Tensor]:
    """The error of each prediction, 0 where there is no score, and a mask of the existing scores."""
    known = ~scores.isnan()
    return torch.where(known, answers - scores, 0.0), known
