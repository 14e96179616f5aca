"""From a checkpoint's config to a network, ready for its weights or for training."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import torch

from reward_model.checkpoint import CheckpointError, NetworkConfig
from reward_model.compiled import EdgelessMPNN

if TYPE_CHECKING:
    from reward_model.models.graph_network import GraphNetwork

    TrainableNetwork: TypeAlias = EdgelessMPNN | GraphNetwork


def network_on_dgl(config: NetworkConfig) -> GraphNetwork:
    """The network as it is defined, edge by edge.

    Raises `CheckpointError` where DGL cannot be imported.
    """
    try:
        from reward_model.models.gat import GAT
        from reward_model.models.mpnn import MPNN
        from reward_model.models.rgcn import RGCN
    except ImportError as error:
        raise CheckpointError(f"the dgl form needs DGL, which cannot be imported here ({error})") from None
    if config.kind == "rgcn":
        return RGCN(config.sizes, config.num_bases, config.dropout)
    if config.kind == "gat":
        return GAT(config.sizes, config.num_heads, config.negative_slope, config.dropout)
    return MPNN(config.sizes, config.edge_network)


def trainable_network(config: NetworkConfig, seed: int) -> TrainableNetwork:
    """A network with the weights that training starts from, the same for the same seed.

    An MPNN with tabulated edge networks is trained in its compiled form, all others on DGL. Raises
    `CheckpointError` where DGL is needed and cannot be imported.
    """
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        if config.kind == "mpnn" and config.edge_network == "tabulated":
            return EdgelessMPNN(config.sizes, config.edge_network)
        return network_on_dgl(config)
