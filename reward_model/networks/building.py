"""From a config to a network: for training, or with a checkpoint's weights."""

from __future__ import annotations

import torch

from reward_model.base.lazy import entry_point
from reward_model.networks.checkpoint import Checkpoint, CheckpointError, check_tensors
from reward_model.networks.registry import NETWORKS, NetworkConfig
from reward_model.networks.window_network import WindowNetwork


def network_on_dgl(config: NetworkConfig, device: str = "cpu") -> WindowNetwork:
    """The network as it is defined, edge by edge; it still has to be moved to the device.

    Raises:
        CheckpointError: If the network is not one on DGL, or DGL cannot be imported, or cannot use the device: it comes
            without CUDA, too.
    """
    network = NETWORKS[config.kind]
    if not network.on_dgl:
        raise CheckpointError(f"the network {config.kind} has no dgl form; form must be 'auto' or 'compiled'")
    _check_dgl(device)
    return _built(network.definition, config)


def trainable_network(config: NetworkConfig, seed: int) -> WindowNetwork:
    """A network with the weights that training starts from, the same for the same seed.

    Raises:
        CheckpointError: If DGL is needed and cannot be imported.
    """
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        return _trainable(config)


def trained_network(checkpoint: Checkpoint) -> WindowNetwork:
    """The network of a checkpoint in the form that is trained.

    Raises:
        CheckpointError: If the weights do not fit it, or DGL is needed and cannot be imported.
    """
    return with_weights(_trainable(checkpoint.config), checkpoint)


def with_weights(network: WindowNetwork, checkpoint: Checkpoint) -> WindowNetwork:
    """The same network with a checkpoint's weights. Raises `CheckpointError` where they do not fit it."""
    check_tensors(checkpoint, {name: tuple(tensor.shape) for name, tensor in network.state_dict().items()})
    network.load_state_dict(checkpoint.tensors)
    return network


def usable_device(config: NetworkConfig, device: str) -> None:
    """Check that a network can be trained on a device.

    Raises:
        ValueError: If PyTorch cannot use it.
        CheckpointError: If the network needs DGL and that cannot.
    """
    torch_device(device)
    if NETWORKS[config.kind].trained_on_dgl:
        _check_dgl(device)


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


def _trainable(config: NetworkConfig) -> WindowNetwork:
    network = NETWORKS[config.kind]
    if network.trained_on_dgl:
        _check_dgl("cpu")
    return _built(network.trained or network.definition, config)


def _built(name: str, config: NetworkConfig) -> WindowNetwork:
    network: WindowNetwork = entry_point(name)(config.sizes, **config.options())
    return network


def _check_dgl(device: str) -> None:
    try:
        from reward_model.networks.batching import runs_on
    except ImportError as error:
        raise CheckpointError(f"the dgl form needs DGL, which cannot be imported here ({error})") from None
    if device != "cpu" and not runs_on(device):
        raise CheckpointError(f"a network on DGL must run on the cpu here, this DGL cannot use device {device!r}")
