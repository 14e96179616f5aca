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
        """(num_windows, 2) scores before the final ReLU, what training works on.

        Args:
            windows: one to three frames each, newest first
        """

    def for_scoring(self, device: torch.device, operators_file: Path | None = None) -> WindowNetwork:
        """The network as it scores on a device: itself, unless it has a form that follows from the final weights.

        Args:
            operators_file: may keep what takes long to compute from the weights
        """
        return self.eval().to(device)
