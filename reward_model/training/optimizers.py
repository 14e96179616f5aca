"""The optimizers of a training with their schedules, and their states as tensors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import torch
from torch import Tensor, nn

if TYPE_CHECKING:
    from reward_model.training.fit import TrainingConfig

WARM_UP: Final = 0.15  # share of a training's steps in which muon's rates rise


class Stepper:
    """An optimizer and its schedule, which take a step together."""

    def __init__(self, optimizer: torch.optim.Optimizer, schedule: torch.optim.lr_scheduler.LRScheduler) -> None:
        self._optimizer, self._schedule = optimizer, schedule

    def step(self) -> None:
        """Change the parameters along their gradients, and then the learning rate."""
        self._optimizer.step()
        self._schedule.step()

    def progress(self) -> dict[str, Any]:
        """What is not a tensor of the state."""
        return {"groups": self._optimizer.state_dict()["param_groups"], "schedule": self._schedule.state_dict()}

    def tensors(self) -> dict[str, Tensor]:
        """The tensors of the state by the number of their parameter and their name."""
        state = self._optimizer.state_dict()["state"]
        return {f"{index}.{name}": tensor for index, values in state.items() for name, tensor in values.items()}

    def restore(self, progress: dict[str, Any], tensors: dict[str, Tensor]) -> None:
        """Go on from a state."""
        moments: dict[int, dict[str, Tensor]] = {}
        for name, tensor in tensors.items():
            index, key = name.split(".")
            moments.setdefault(int(index), {})[key] = tensor
        self._optimizer.load_state_dict({"state": moments, "param_groups": progress["groups"]})
        self._schedule.load_state_dict(progress["schedule"])


def steppers(network: nn.Module, config: TrainingConfig, steps: int) -> list[Stepper]:
    """The optimizers of a network's parameters for a training of so many steps; see `TrainingConfig.optimizer`."""
    rate = config.learning_rate
    if config.optimizer == "adamw":
        adamw = torch.optim.AdamW(network.parameters(), lr=rate, weight_decay=config.weight_decay)
        return [Stepper(adamw, torch.optim.lr_scheduler.CosineAnnealingLR(adamw, steps, rate / 100))]
    matrices = [each for each in network.parameters() if each.ndim == 2 and min(each.shape) > 2]
    chosen = {id(each) for each in matrices}
    others = [each for each in network.parameters() if id(each) not in chosen]
    return [
        _rising_and_falling(torch.optim.AdamW(others, lr=rate, weight_decay=config.weight_decay), rate, steps),
        _rising_and_falling(
            torch.optim.Muon(matrices, lr=config.matrix_rate, weight_decay=config.weight_decay),
            config.matrix_rate,
            steps,
        ),
    ]


def _rising_and_falling(optimizer: torch.optim.Optimizer, rate: float, steps: int) -> Stepper:
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimizer, rate, total_steps=steps + 1, pct_start=WARM_UP, cycle_momentum=False
    )
    return Stepper(optimizer, schedule)
