"""Training of a network on another one's scores, the differences between the two, and the model card."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from rich.progress import Progress

from reward_model.base.files import replace_file
from reward_model.data.augmentation import WithMirrorImages
from reward_model.data.examples import Part
from reward_model.data.labelling import label_windows
from reward_model.graph.frame import FrameGraph
from reward_model.networks.checkpoint import Checkpoint, save_checkpoint
from reward_model.networks.registry import NetworkConfig
from reward_model.scenes.scene import ScenarioError, SceneSequence
from reward_model.scenes.socnav2_json import read_socnav2
from reward_model.scorer import SocialScorer
from reward_model.training.fit import TrainingConfig
from reward_model.training.session import epoch_bar, learn_windows

CARD_FILE: Final = "README.md"
_DROPPED: Final = 3  # snapshots cut off a recording's end for a second row, as in the published reference
_REFERENCE_FILE: Final = "reference.json"  # the published network's scores, beside SocNav2's sample recordings


def distil(
    teacher: SocialScorer,
    windows: Mapping[Part, Sequence[Sequence[FrameGraph]]],
    network: NetworkConfig,
    config: TrainingConfig,
    progress: Progress,
) -> Checkpoint:
    """Train a network on a teacher's scores of windows, and of the training windows' mirror images.

    Args:
        windows: of all three parts

    Returns:
        The checkpoint of `learn_windows`, with the teacher and the numbers of windows in its `about`.
    """
    labelled = {}
    for part, each in windows.items():
        chosen = WithMirrorImages(each) if part == "train" else each
        bar = progress.add_task(f"label {part}", total=len(chosen))
        labelled[part] = label_windows(teacher, chosen, partial(progress.advance, bar))
    student = learn_windows(network, config, labelled, epoch_bar(progress, config.max_epochs))
    counts = {part: len(each) for part, each in windows.items()}
    return replace(student, about={"teacher": teacher.name, "windows": counts, **student.about})


def save_with_card(path: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint folder with its model card. Raises `OSError` where it cannot be written."""
    save_checkpoint(path, checkpoint)
    replace_file(path / CARD_FILE, model_card(checkpoint).encode())


def recordings_to_compare(folder: Path) -> list[SceneSequence]:
    """Every SocNav2 recording of a folder, first whole and then without its last snapshots.

    Raises:
        ScenarioError: If there is none or one cannot be read.
    """
    paths = sorted(path for path in folder.glob("*.json") if path.name != _REFERENCE_FILE)
    if not paths:
        raise ScenarioError(f"{folder}: must hold SocNav2 recordings (*.json), found none")
    whole = [read_socnav2(path) for path in paths]
    return [*whole, *(SceneSequence(each.snapshots[:-_DROPPED], each.name) for each in whole)]


def compared(teacher: SocialScorer, student: Checkpoint, recordings: Sequence[SceneSequence]) -> Checkpoint:
    """The student's checkpoint, with the differences of its scores of recordings from the teacher's in `about`.

    `genuine_error`: the number of recordings, each question's mean absolute difference, and the largest difference.
    """
    differences = np.abs(SocialScorer(student, "student").score_batch(recordings) - teacher.score_batch(recordings))
    q1, q2 = map(float, differences.mean(axis=0))
    found = {"rows": len(recordings), "q1_mae": q1, "q2_mae": q2, "worst": float(differences.max())}
    return replace(student, about={**student.about, "genuine_error": found})


def model_card(checkpoint: Checkpoint) -> str:
    """The README of a checkpoint that `train_reward.py` has trained.

    The checkpoint's `about` is that of `distil`, or of `compared` where recordings were compared.
    """
    about, sizes = checkpoint.about, "-".join(map(str, checkpoint.config.sizes))
    windows, test_error = about["windows"], about["test_error"]
    return f"""# The default reward network

An MPNN of {sizes} features with {about["parameters"]:,} parameters. It gives Q1 and Q2, 0 to 1, for the last
second of a scene (three frames, one second apart).

**What it learned from.** The answers of the published network (Bachiller et al. 2021) to {windows["train"]:,}
windows of *simulated* scenes and to as many mirror images: people walk by social force, and the robot is driven well
and badly. It is not trained on SocNav2's human scores, and its answers are not human scores: it inherits the published
network's errors and adds its own.

**How.** Mean squared error, AdamW with a cosine schedule, early stopping on {windows["development"]:,} windows of
other episodes; {about["epochs"]} epochs, seed {about["training"]["seed"]}. `python train_reward.py` repeats it.

**How close it is to its teacher.**

| compared on | Q1 | Q2 |
|---|---|---|
| {windows["test"]:,} windows of held-out simulated episodes, mean squared error | {test_error["q1"]:.5f} \
| {test_error["q2"]:.5f} |
{_genuine_row(about)}
**Where not to trust it.** Rooms larger than 12 m, robots faster than 0.37 m/s, more than about 18 people: nothing
of the kind was in its training. For numbers to compare with the literature use the published network.
"""


def _genuine_row(about: dict[str, Any]) -> str:
    if "genuine_error" not in about:
        return ""
    found = about["genuine_error"]
    return (
        f"| {found['rows']} rows of genuine SocNav2 recordings, mean absolute error "
        f"| {found['q1_mae']:.4f} | {found['q2_mae']:.4f} |\n"
    )
