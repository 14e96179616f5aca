"""Scoring of scenes by a trained network."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final, Literal, NamedTuple, Protocol

import numpy as np
import platformdirs
import torch
from numpy.typing import NDArray

from reward_model.base.arrays import Float32Array
from reward_model.base.lazy import entry_point
from reward_model.graph.facts import facts_of, training_range
from reward_model.graph.features import NUM_FRAMES
from reward_model.graph.frame import FrameGraph
from reward_model.graph.windows import sequence_frames
from reward_model.networks.building import network_on_dgl, torch_device, trained_network, with_weights
from reward_model.networks.checkpoint import Checkpoint, CheckpointError, load_checkpoint
from reward_model.networks.operator_cache import OPERATORS_FILE
from reward_model.networks.registry import NETWORKS
from reward_model.networks.window_network import WindowNetwork
from reward_model.scenes.scene import SceneSequence, Scores

Form = Literal["auto", "compiled", "dgl"]
FORMS: Final[tuple[Form, ...]] = ("auto", "compiled", "dgl")
_LARGEST_BATCH: Final = 256  # windows at once, so that memory stays small for any number of sequences


class Assessment(NamedTuple):
    """Scores of windows, and how far an ensemble's members are apart.

    Attributes:
        scores: (num_windows, 2) Q1 and Q2
        deviations: (num_windows, 2) the members' standard deviations, 0 for a single network
        in_range: (num_windows,) whether scenes are like those of the training, where the checkpoint says what they were
    """

    scores: Float32Array
    deviations: Float32Array
    in_range: NDArray[np.bool_]

    def rows(self) -> list[Scores]:
        """The scores of each window."""
        columns = zip(*self.scores.T.tolist(), *self.deviations.T.tolist(), self.in_range.tolist(), strict=True)
        return [Scores(*row) for row in columns]


class _Network(Protocol):
    def __call__(self, windows: Sequence[Sequence[FrameGraph]]) -> Float32Array:
        """The windows' scores, (num_windows, 2); or also their standard deviations, and 1 for scenes in range."""
        ...


class SocialScorer:
    """A trained network that predicts how acceptable people find a robot's last second.

    Args:
        name: name of the weights, for reports
        form: `compiled` (needs no DGL: compiled code on the CPU, elsewhere PyTorch for networks that are trained
            without DGL), `dgl` (the network as it is defined), or `auto`, the compiled form where there is one and else
            DGL's
        device: PyTorch's name of the device; compiled networks are fastest for single windows on `cpu`
        operators_file: cache of the operators that the compiled form computes from the weights

    Attributes:
        training_range: of the facts of the scenes that it was trained on, where the checkpoint says so

    Raises:
        CheckpointError: If the weights do not fit their network, it has no compiled form for the device or DGL is not
            installed.
        ValueError: For an unknown form or a missing device.
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
        try:
            self.training_range = training_range(checkpoint.about)
        except ValueError as error:
            raise CheckpointError(str(error)) from None
        self._network = _network(checkpoint, form, torch_device(device), operators_file)

    def score(self, sequence: SceneSequence) -> Scores:
        """Score the last second of one sequence."""
        return self.assess_windows([sequence_frames(sequence)]).rows()[0]

    def score_batch(self, sequences: Sequence[SceneSequence]) -> Float32Array:
        """Q1 and Q2 (num_sequences, 2) of each sequence's last second. Raises `ScenarioError` as `frame_graph`."""
        return self.score_windows([sequence_frames(sequence) for sequence in sequences])

    def score_windows(self, windows: Sequence[Sequence[FrameGraph]]) -> Float32Array:
        """Q1 and Q2 (num_windows, 2) of windows of one to three frames, newest first, made by `frame_graph`.

        Raises:
            ValueError: For a window of another number of frames.
        """
        return self.assess_windows(windows).scores

    def out_of_range(self, windows: Sequence[Sequence[FrameGraph]]) -> list[tuple[str, ...]]:
        """What about each window lies outside of the training data, in words such as `room of 30 m`.

        Nothing does where the checkpoint does not say what its training data was.
        """
        if self.training_range is None:
            return [()] * len(windows)
        return self.training_range.exceeded(facts_of(windows))

    def assess_windows(self, windows: Sequence[Sequence[FrameGraph]]) -> Assessment:
        """Scores and deviations of windows as for `score_windows`."""
        if not windows:
            nothing = np.zeros((0, 2), dtype=np.float32)
            return Assessment(nothing, nothing, np.ones(0, dtype=np.bool_))
        for index, window in enumerate(windows):
            if not 1 <= len(window) <= NUM_FRAMES:
                raise ValueError(f"window {index} must have 1 to {NUM_FRAMES} frames, got {len(window)}")
        answers = self._network(windows)
        scores = answers[:, :2]
        deviations = answers[:, 2:4] if answers.shape[1] > 2 else np.zeros_like(scores)
        if answers.shape[1] == 5:
            return Assessment(scores, deviations, answers[:, 4] == 1)
        if self.training_range is None:
            return Assessment(scores, deviations, np.ones(len(windows), dtype=np.bool_))
        return Assessment(scores, deviations, self.training_range.contains(facts_of(windows)))


def _network(checkpoint: Checkpoint, form: Form, device: torch.device, operators_file: Path | None) -> _Network:
    kind, network = checkpoint.config.kind, NETWORKS[checkpoint.config.kind]
    if form != "dgl" and network.compiled and device.type == "cpu":
        compiled: _Network = entry_point(network.compiled)(checkpoint, operators_file)
        return compiled
    if form != "dgl" and not network.trained_on_dgl:
        return _OnPyTorch(trained_network(checkpoint).for_scoring(device, operators_file), device, _LARGEST_BATCH)
    if form == "compiled":
        where = f"runs on the cpu only, got device '{device}'" if network.compiled else "does not exist"
        raise CheckpointError(f"the compiled form of {kind} {where}")
    on_dgl = with_weights(network_on_dgl(checkpoint.config, str(device)), checkpoint)
    return _OnPyTorch(on_dgl.for_scoring(device), device, 1)


class _OnPyTorch:
    """A network that computes on PyTorch, with DGL or without, so many windows at once."""

    def __init__(self, network: WindowNetwork, device: torch.device, batch_size: int) -> None:
        self._network, self._device, self._batch_size = network, device, batch_size

    def __call__(self, windows: Sequence[Sequence[FrameGraph]]) -> Float32Array:
        with torch.inference_mode():
            answers = [
                self._network.scores_and_deviations(windows[start : start + self._batch_size], self._device)
                for start in range(0, len(windows), self._batch_size)
            ]
        scores: Float32Array = torch.cat(answers).cpu().numpy()
        return scores


def load_scorer(weights: str | Path = "default", form: Form = "auto", device: str = "cpu") -> SocialScorer:
    """Load a scorer.

    Args:
        weights: `default` (shipped here), `published` (Bachiller et al.'s network, once imported) or a checkpoint
            folder
        form, device: see `SocialScorer`

    Raises:
        CheckpointError: If there is no such checkpoint or it cannot be used.
        ValueError: As `SocialScorer`.
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
