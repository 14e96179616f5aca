"""Scoring of scenes by a trained network."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final, Literal, Protocol

import numpy as np
import platformdirs
import torch

from reward_model.base.arrays import Float32Array
from reward_model.fast.engine import FusedNetwork
from reward_model.fast.from_checkpoint import FLAT_KINDS, flat_network, tensor_shapes
from reward_model.fast.relational_weights import flat_layers
from reward_model.graph.features import NUM_FRAMES
from reward_model.graph.frame import FrameGraph
from reward_model.graph.windows import sequence_frames
from reward_model.networks.checkpoint import Checkpoint, CheckpointError, NetworkConfig, load_checkpoint
from reward_model.networks.factorised_mpnn import EdgelessMPNN, propagate
from reward_model.networks.operator_cache import OPERATORS_FILE, kept_operators
from reward_model.networks.padded_windows import pack_windows
from reward_model.networks.registry import network_on_dgl, torch_device
from reward_model.scenes.scene import SceneSequence, Scores

Form = Literal["auto", "compiled", "dgl"]
FORMS: Final[tuple[Form, ...]] = ("auto", "compiled", "dgl")
_LARGEST_BATCH: Final = 256  # windows at once, so that memory stays small for any number of sequences


class _Network(Protocol):
    def __call__(self, windows: Sequence[Sequence[FrameGraph]]) -> Float32Array:
        """The windows' scores, (num_windows, 2)."""
        ...


class SocialScorer:
    """A trained network that predicts how acceptable people find a robot's last second.

    name: name of the weights, for reports
    form: `compiled` (fast, needs no DGL; an R-GCN's and a GAT's run on the CPU only), `dgl` (the network as it is
        defined), or `auto`, the compiled form where there is one for the device and else DGL's
    device: PyTorch's name of the device; compiled networks are fastest for single windows on `cpu`
    operators_file: cache of the operators that the compiled form computes from the weights
    Raises `CheckpointError` where the weights do not fit their network, it has no compiled form for the device or DGL
    is not installed, and `ValueError` for an unknown form or a missing device.
    """

    def __init__(
        self,
        checkpoint: Checkpoint,
        name: str,
        form: Form = "auto",
        device: str = "cpu",
        operators_file: Path | None = None,
    ) -> None:
        if form not in FORMS:
            raise ValueError(f"form must be one of {list(FORMS)}, got {form!r}")
        self.name = name
        self._network = _network(checkpoint, form, torch_device(device), operators_file)

    def score(self, sequence: SceneSequence) -> Scores:
        """Score the last second of one sequence."""
        q1, q2 = self.score_batch([sequence])[0].tolist()
        return Scores(q1, q2)

    def score_batch(self, sequences: Sequence[SceneSequence]) -> Float32Array:
        """Q1 and Q2 (num_sequences, 2) of each sequence's last second. Raises `ScenarioError` as `frame_graph`."""
        return self.score_windows([sequence_frames(sequence) for sequence in sequences])

    def score_windows(self, windows: Sequence[Sequence[FrameGraph]]) -> Float32Array:
        """Q1 and Q2 (num_windows, 2) of windows of one to three frames, newest first, made by `frame_graph`.

        Raises `ValueError` for a window of another number of frames.
        """
        if not windows:
            return np.zeros((0, 2), dtype=np.float32)
        for index, window in enumerate(windows):
            if not 1 <= len(window) <= NUM_FRAMES:
                raise ValueError(f"window {index} must have 1 to {NUM_FRAMES} frames, got {len(window)}")
        return self._network(windows)


def _network(checkpoint: Checkpoint, form: Form, device: torch.device, operators_file: Path | None) -> _Network:
    kind = checkpoint.config.kind
    if form == "dgl" or (form == "auto" and kind in FLAT_KINDS and device.type != "cpu"):
        return _OnDGL(checkpoint, device)
    if kind not in FLAT_KINDS:
        return _CompiledMPNN(checkpoint, device, operators_file)
    if device.type != "cpu":
        raise CheckpointError(f"the compiled form of {kind} runs on the cpu only, got device '{device}'")
    _check_state(checkpoint, tensor_shapes(checkpoint.config))
    return FusedNetwork(flat_network(checkpoint.config, checkpoint.tensors))


class _CompiledMPNN:
    """Windows through compiled code of our own on the CPU, or padded together through PyTorch wherever else."""

    def __init__(self, checkpoint: Checkpoint, device: torch.device, operators_file: Path | None) -> None:
        network = EdgelessMPNN(checkpoint.config.sizes, checkpoint.config.edge_network)
        _load_state(network, checkpoint)
        with torch.no_grad():
            layers = (
                network.operators()
                if operators_file is None
                else kept_operators(operators_file, checkpoint.tensors, network.operators)
            )
        self._fused = FusedNetwork(flat_layers(layers)) if device.type == "cpu" else None
        self._layers = [layer.to(device) for layer in layers]
        self._device = device

    def __call__(self, windows: Sequence[Sequence[FrameGraph]]) -> Float32Array:
        if self._fused is not None:
            return self._fused(windows)
        with torch.inference_mode():
            answers = [
                torch.relu(
                    propagate(pack_windows(windows[start : start + _LARGEST_BATCH]).to(self._device), self._layers)
                )
                for start in range(0, len(windows), _LARGEST_BATCH)
            ]
        scores: Float32Array = torch.cat(answers).cpu().numpy()
        return scores


class _OnDGL:
    def __init__(self, checkpoint: Checkpoint, device: torch.device) -> None:
        self._network = network_on_dgl(checkpoint.config, str(device))
        _load_state(self._network, checkpoint)
        self._network.eval().to(device)
        self._device = device

    def __call__(self, windows: Sequence[Sequence[FrameGraph]]) -> Float32Array:
        with torch.inference_mode():
            answers = [torch.relu(self._network.answers([window], self._device)) for window in windows]
        scores: Float32Array = torch.cat(answers).cpu().numpy()
        return scores


def load_scorer(weights: str | Path = "default", form: Form = "auto", device: str = "cpu") -> SocialScorer:
    """Load a scorer.

    weights: `default` (shipped here), `published` (Bachiller et al.'s network, once imported) or a checkpoint folder
    form, device: see `SocialScorer`
    Raises `CheckpointError` where there is no such checkpoint or it cannot be used, `ValueError` as `SocialScorer`.
    """
    path = weights_path(weights)
    checkpoint = load_checkpoint(path)
    operators_file = path / OPERATORS_FILE if weights == "published" else None  # nothing is written to other folders
    try:
        return SocialScorer(checkpoint, str(weights), form, device, operators_file)
    except CheckpointError as error:
        raise CheckpointError(f"{path}: {error}") from None


def weights_path(weights: str | Path) -> Path:
    """The checkpoint folder of a name or path. Raises `CheckpointError` where there is none."""
    if weights == "default":
        return Path(__file__).parent / "weights" / "default"
    if weights == "published":
        path = cache_folder() / "published"
        if not path.is_dir():
            raise CheckpointError(
                "the published weights are not in the cache; fetch them once with "
                "`python -m reward_model import-published socnavgym==0.1.1`"
            )
        return path
    path = Path(weights)
    if not path.is_dir():
        raise CheckpointError(f"weights must be 'default', 'published' or a checkpoint folder, got {str(weights)!r}")
    return path


def cache_folder() -> Path:
    """The folder of files fetched at run time: `SOCNAV_CACHE`, or the user's cache folder."""
    return Path(os.environ.get("SOCNAV_CACHE") or platformdirs.user_cache_dir("socnav2"))


def _load_state(network: torch.nn.Module, checkpoint: Checkpoint) -> None:
    _check_state(checkpoint, {name: tuple(tensor.shape) for name, tensor in network.state_dict().items()})
    network.load_state_dict(checkpoint.tensors)


def _check_state(checkpoint: Checkpoint, expected: dict[str, tuple[int, ...]]) -> None:
    found = {name: tuple(tensor.shape) for name, tensor in checkpoint.tensors.items()}
    fits = f"the weights do not fit the network {_describe(checkpoint.config)}"
    if odd := sorted(expected.keys() ^ found.keys()):
        raise CheckpointError(f"{fits}: {odd[0]} is {'missing' if odd[0] in expected else 'not part of it'}")
    for name, shape in expected.items():
        if found[name] != shape:
            raise CheckpointError(f"{fits}: {name} must have shape {shape}, got {found[name]}")


def _describe(config: NetworkConfig) -> str:
    options = {key: value for key, value in config.document().items() if key not in ("kind", "sizes")}
    return f"{config.kind} {'-'.join(map(str, config.sizes))} ({', '.join(map(str, options.values()))})"
