"""What every network is to training and scoring: windows in, answers out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

import torch
from torch import Tensor, nn

from reward_model.graph.frame import FrameGraph


class WindowNetwork(nn.Module, ABC):
    """A network on PyTorch, with DGL or without.

    Attributes:
        windows_at_once: how many are answered in one batch where no gradients are needed
    """

    windows_at_once: ClassVar[int] = 256

    @abstractmethod
    def answers(self, windows: Sequence[Sequence[FrameGraph]], device: torch.device | str = "cpu") -> Tensor:
        """(num_windows, 2) scores before the final ReLU.

        Args:
            windows: one to three frames each, newest first
        """

    def prepare(self, windows: Sequence[Sequence[FrameGraph]]) -> None:
        """Set what follows from the training windows and is not trained, once before training."""
        return

    def training_answers(self, windows: Sequence[Sequence[FrameGraph]], device: torch.device | str = "cpu") -> Tensor:
        """(num_members, num_windows, 2) what training works on: the answers of each network of an ensemble."""
        return self.answers(windows, device).unsqueeze(0)

    def scores_and_deviations(
        self, windows: Sequence[Sequence[FrameGraph]], device: torch.device | str = "cpu"
    ) -> Tensor:
        """(num_windows, 4) scores of Q1 and Q2, and their standard deviations, 0 where there is one network."""
        scores = torch.relu(self.answers(windows, device))
        return torch.cat([scores, torch.zeros_like(scores)], dim=1)

    def for_scoring(self, device: torch.device, operators_file: Path | None = None) -> WindowNetwork:
        """The network as it scores on a device: itself, unless it has a form that follows from the final weights.

        Args:
            operators_file: may keep what takes long to compute from the weights
        """
        return self.eval().to(device)
