"""Scene graphs -> one DGL graph, the input of every network in this folder."""

from __future__ import annotations

from collections.abc import Sequence

import dgl
import numpy as np
import torch

from reward_model.graph.windows import SceneGraph


def dgl_graph(graphs: Sequence[SceneGraph]) -> dgl.DGLGraph:
    """Join scene graphs into one batched DGL graph.

    Node data: `features` (num_nodes, 42), `is_output` (num_nodes,) true on each newest frame's room node.
    Edge data: `features` (num_edges, 18), `relation` (num_edges,).
    """
    starts = np.cumsum([0, *(len(graph.features) for graph in graphs)])
    sources = np.concatenate([graph.sources + start for graph, start in zip(graphs, starts, strict=False)])
    targets = np.concatenate([graph.targets + start for graph, start in zip(graphs, starts, strict=False)])
    batch = dgl.graph((torch.from_numpy(sources), torch.from_numpy(targets)), num_nodes=int(starts[-1]))
    batch.ndata["features"] = torch.from_numpy(np.concatenate([graph.features for graph in graphs]))
    is_output = torch.zeros(int(starts[-1]), dtype=torch.bool)
    is_output[torch.from_numpy(starts[:-1])] = True
    batch.ndata["is_output"] = is_output
    batch.edata["features"] = torch.from_numpy(np.concatenate([graph.edge_features for graph in graphs]))
    batch.edata["relation"] = torch.from_numpy(np.concatenate([graph.relations for graph in graphs])).long()
    return batch


def runs_on(device: str) -> bool:
    """Whether this build of DGL can use a device."""
    try:
        dgl.graph(([0], [0])).to(device)
    except (dgl.DGLError, KeyError, RuntimeError, AssertionError):  # a build without CUDA, DGL's or PyTorch's
        return False
    return True
