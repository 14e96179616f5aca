"""From checkpoints to networks in compiled code, the entry points of `reward_model.networks.registry`.

DGL is not needed: an R-GCN's and a GAT's tensors, with the names and shapes of DGL's `RelGraphConv` and `GATConv`, are
brought into the order of compiled code here, an MPNN's in `relational_weights`.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from reward_model.base.arrays import Float32Array
from reward_model.fast.attention_kernels import AttentionNetwork, score_by_attention
from reward_model.fast.engine import FusedNetwork
from reward_model.fast.grouped_window import FEATURES
from reward_model.fast.matmul import LANES
from reward_model.fast.relational_kernels import score_by_relation
from reward_model.fast.relational_weights import RelationalNetwork, flat_layers
from reward_model.fast.star_layers import score_stars
from reward_model.fast.star_weights import star_arrays
from reward_model.graph.facts import training_range
from reward_model.graph.features import NUM_RELATIONS
from reward_model.graph.packing import NUM_PACKED
from reward_model.networks.building import trained_network
from reward_model.networks.checkpoint import Checkpoint, check_tensors
from reward_model.networks.edge_networks import MEASURED, PLAIN, LayerOperators
from reward_model.networks.factorised_mpnn import FactorisedMPNN
from reward_model.networks.registry import GATConfig, NetworkConfig, RGCNConfig
from reward_model.networks.star import StarNetwork

_STARS_TOGETHER = 16  # windows, whose rows fit into a core's own cache


def compiled_rgcn(checkpoint: Checkpoint, operators_file: Path | None = None) -> FusedNetwork:
    """An R-GCN. Raises `CheckpointError` where the weights do not fit it."""
    config = checkpoint.config
    assert isinstance(config, RGCNConfig)
    check_tensors(checkpoint, tensor_shapes(config))
    return FusedNetwork(_flat_rgcn(config, checkpoint.tensors), score_by_relation)


def compiled_gat(checkpoint: Checkpoint, operators_file: Path | None = None) -> FusedNetwork:
    """A GAT. Raises `CheckpointError` where the weights do not fit it."""
    config = checkpoint.config
    assert isinstance(config, GATConfig)
    check_tensors(checkpoint, tensor_shapes(config))
    return FusedNetwork(_flat_gat(config, checkpoint.tensors), score_by_attention)


def compiled_mpnn(checkpoint: Checkpoint, operators_file: Path | None = None) -> FusedNetwork:
    """An MPNN. Raises `CheckpointError` where the weights do not fit it.

    Args:
        operators_file: may keep its operators, which take seconds to compute from the weights of perceptrons
    """
    network = trained_network(checkpoint)
    assert isinstance(network, FactorisedMPNN)
    return FusedNetwork(flat_layers(network.scoring_operators(operators_file)), score_by_relation)


def compiled_star(checkpoint: Checkpoint, operators_file: Path | None = None) -> FusedNetwork:
    """A star network. Raises `CheckpointError` where the weights do not fit it."""
    network = trained_network(checkpoint)
    assert isinstance(network, StarNetwork)
    arrays = star_arrays(network, checkpoint.config.sizes[1:-1], training_range(checkpoint.about))
    return FusedNetwork(arrays, score_stars, columns=5, together=_STARS_TOGETHER)


def tensor_shapes(config: NetworkConfig) -> dict[str, tuple[int, ...]]:
    """The names and shapes of all tensors that an R-GCN or a GAT has on DGL."""
    if isinstance(config, RGCNConfig):
        layers = [_rgcn_shapes(config, *widths) for widths in pairwise(config.sizes)]
    else:
        assert isinstance(config, GATConfig)
        inputs = (config.sizes[0], *(config.num_heads * size for size in config.sizes[1:-1]))
        layers = [_gat_shapes(config, *widths) for widths in zip(inputs, config.sizes[1:], strict=True)]
    return {f"layers.{index}.{name}": shape for index, layer in enumerate(layers) for name, shape in layer.items()}


def _rgcn_shapes(config: RGCNConfig, inputs: int, outputs: int) -> dict[str, tuple[int, ...]]:
    bases = min(config.num_bases, NUM_RELATIONS)
    return {
        "h_bias": (outputs,),
        "linear_r.W": (bases, inputs, outputs),
        "linear_r.coeff": (NUM_RELATIONS, bases),
    }


def _flat_rgcn(config: RGCNConfig, tensors: Mapping[str, Tensor]) -> RelationalNetwork:
    operators = []
    for index in range(len(config.sizes) - 1):
        bases, mixed = (tensors[f"layers.{index}.linear_r.{name}"].float() for name in ("W", "coeff"))
        matrices = torch.einsum("rb,bio->rio", mixed, bases)
        length = torch.zeros((len(MEASURED), 1))  # which the network does not see
        operators.append(
            LayerOperators(
                plain=matrices[list(PLAIN)],
                basis=matrices[list(MEASURED)].unsqueeze(1),
                knots=length,
                coefficients=torch.ones((len(MEASURED), 1, 1)),
                bias=tensors[f"layers.{index}.h_bias"],
            )
        )
    return flat_layers(operators, by_relation=True)


def _gat_shapes(config: GATConfig, inputs: int, outputs: int) -> dict[str, tuple[int, ...]]:
    heads = config.num_heads
    return {
        "attn_l": (1, heads, outputs),
        "attn_r": (1, heads, outputs),
        "bias": (heads * outputs,),
        "fc.weight": (heads * outputs, inputs),
    }


def _flat_gat(config: GATConfig, tensors: Mapping[str, Tensor]) -> AttentionNetwork:
    """Layer by layer what `reward_model.fast.attention_kernels.gat_layer_at` finds again."""
    parts: list[Float32Array] = []
    shapes = []
    for index, outputs in enumerate(config.sizes[1:]):
        layer = {name: tensors[f"layers.{index}.{name}"].float() for name in _gat_shapes(config, 1, 1)}
        matrices = _gat_matrices(layer, config.num_heads, outputs)
        if index == 0:
            matrices = np.concatenate([_rows(matrices, list(columns)) for columns in FEATURES])
        start = sum(part.size for part in parts)
        shapes.append((start, *matrices.shape, config.num_heads, outputs))
        parts += [matrices, layer["bias"].numpy(), np.array([config.negative_slope], dtype=np.float32)]
    weights = np.concatenate([part.ravel() for part in parts])
    return AttentionNetwork(weights, np.array(shapes, dtype=np.int64))


def _gat_matrices(layer: Mapping[str, Tensor], heads: int, outputs: int) -> Float32Array:
    """(in, width) the columns of `reward_model.fast.attention_kernels.GATLayer`."""
    said = layer["fc.weight"].T
    by_head = said.reshape(-1, heads, outputs)
    attention = [(by_head * layer[name]).sum(dim=2) for name in ("attn_l", "attn_r")]
    matrices = torch.cat([said, *attention], dim=1).numpy()
    return np.pad(matrices, ((0, 0), (0, -matrices.shape[1] % LANES)))


def _rows(matrices: Float32Array, features: list[int]) -> Float32Array:
    return np.pad(matrices[features], ((0, NUM_PACKED - len(features)), (0, 0)))
