"""From a checkpoint's config to a network, ready for its weights or for training."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import torch

from reward_model.networks.checkpoint import CheckpointError, NetworkConfig
from reward_model.networks.factorised_mpnn import EdgelessMPNN

if TYPE_CHECKING:
    from reward_model.networks.graph_network import GraphNetwork

    TrainableNetwork: TypeAlias = EdgelessMPNN | GraphNetwork


def network_on_dgl(config: NetworkConfig, device: str = "cpu") -> GraphNetwork:
    """The network as it is defined, edge by edge; it still has to be moved to the device.

    Raises `CheckpointError` where DGL cannot be imported, or cannot use the device: it comes without CUDA, too.
    """
    try:
        from reward_model.networks.batching import runs_on
        from reward_model.networks.gat import GAT
        from reward_model.networks.mpnn import MPNN
        from reward_model.networks.rgcn import RGCN
    except ImportError as error:
        raise CheckpointError(f"the dgl form needs DGL, which cannot be imported here ({error})") from None
    if device != "cpu" and not runs_on(device):
        raise CheckpointError(f"a network on DGL must run on the cpu here, this DGL cannot use device {device!r}")
    if config.kind == "rgcn":
        return RGCN(config.sizes, config.num_bases, config.dropout)
    if config.kind == "gat":
        return GAT(config.sizes, config.num_heads, config.negative_slope, config.dropout)
    return MPNN(config.sizes, config.edge_network)


def trainable_network(config: NetworkConfig, seed: int) -> TrainableNetwork:
    """A network with the weights that training starts from, the same for the same seed.

    An MPNN is trained in its compiled form, the others on DGL. Raises
    `CheckpointError` where DGL is needed and cannot be imported.
    """
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        if _without_dgl(config):
            return EdgelessMPNN(config.sizes, config.edge_network)
        return network_on_dgl(config)


def usable_device(config: NetworkConfig, device: str) -> None:
    """Check that a network can be trained on a device.

    Raises `ValueError` where PyTorch cannot use it, `CheckpointError` where the network needs DGL and that cannot.
    """
    torch_device(device)
    if not _without_dgl(config):
        network_on_dgl(config, device)


def best_device(config: NetworkConfig) -> str:
    """`cuda` where PyTorch and what the network runs on can use it, else `cpu`."""
    if not torch.cuda.is_available():
        return "cpu"
    try:
        usable_device(config, "cuda")
    except CheckpointError:
        return "cpu"
    return "cuda"


def torch_device(device: str) -> torch.device:
    """The device of that name. Raises `ValueError` where PyTorch cannot use it here."""
    try:
        return torch.empty(0, device=device).device
    except (RuntimeError, AssertionError) as error:  # the latter where PyTorch was built without CUDA
        reason = str(error).splitlines()[0]
        raise ValueError(f"device must be one that PyTorch can use here, got {device!r} ({reason})") from None


def _without_dgl(config: NetworkConfig) -> bool:
    return config.kind == "mpnn"
