"""What every network on DGL has in common: one call, and the scores read at the newest frame's room."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import dgl
import torch
from torch import Tensor

from reward_model.graph.frame import FrameGraph
from reward_model.graph.windows import scene_graph
from reward_model.networks.batching import dgl_graph
from reward_model.networks.window_network import WindowNetwork


class GraphNetwork(WindowNetwork):
    """A network that reads a batch from `reward_model.networks.batching.dgl_graph`."""

    windows_at_once: ClassVar[int] = 32  # every edge may have a matrix of its own

    @abstractmethod
    def node_answers(self, graph: dgl.DGLGraph) -> Tensor:
        """(num_nodes, 2) the last layer's answers at every node, before the final ReLU."""

    def forward(self, graph: dgl.DGLGraph) -> Tensor:
        """(batch_size, 2) scores: the last layer at each newest frame's room, never below 0."""
        return torch.relu(self.node_answers(graph)[graph.ndata["is_output"]])

    def answers(self, windows: Sequence[Sequence[FrameGraph]], device: torch.device | str = "cpu") -> Tensor:
        """(num_windows, 2) scores before the final ReLU, what training works on."""
        graph = dgl_graph([scene_graph(window) for window in windows]).to(device)
        return self.node_answers(graph)[graph.ndata["is_output"]]
