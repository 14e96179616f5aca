"""The differences between a network and the teacher whose scores it learned, and the model card."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from numpy.typing import NDArray

from reward_model.analysis.evaluation import rank_correlation
from reward_model.base.arrays import Float32Array
from reward_model.base.files import replace_file
from reward_model.data.labelling import image_scores
from reward_model.data.taught import TEACHER_RANGE, TaughtWindows
from reward_model.graph.star import Stars
from reward_model.graph.windows import sequence_frames
from reward_model.networks.building import trained_network
from reward_model.networks.checkpoint import Checkpoint, save_checkpoint
from reward_model.scenes.ratings import QUESTIONS
from reward_model.scenes.scene import ScenarioError, SceneSequence
from reward_model.scenes.socnav2_json import read_socnav2
from reward_model.scorer import SocialScorer

CARD_FILE: Final = "README.md"
_DROPPED: Final = 3  # snapshots cut off a recording's end for a second row, as in the published reference
_REFERENCE_FILE: Final = "reference.json"  # the published network's scores, beside SocNav2's sample recordings


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


def compared(teacher: SocialScorer, student: Checkpoint, recordings: Sequence[SceneSequence]) -> dict[str, Any]:
    """How far the student's scores of recordings are from the symmetrised teacher's.

    Returns:
        The number of recordings, each question's mean absolute difference, and the largest difference.
    """
    windows = [sequence_frames(each) for each in recordings]
    taught = image_scores(teacher, windows).mean(axis=1)
    differences = np.abs(SocialScorer(student, "student").score_windows(windows) - taught)
    q1, q2 = map(float, differences.mean(axis=0))
    return {"rows": len(recordings), "q1_mae": q1, "q2_mae": q2, "worst": float(differences.max())}


def differences(student: Checkpoint, taught: TaughtWindows) -> dict[str, Any]:
    """How far a network's scores are from the symmetrised teacher's, and whether its deviations tell how far.

    Returns:
        For the windows in the teacher's range, and for the others out of contact: their number, and for each question
        the mean squared error, that of the teacher's single answers, and Spearman's rank correlation of the standard
        deviation with the absolute error. The largest score in contact.
    """
    found = _assessed(student, taught.stars)
    rest = ~taught.touching & ~taught.in_teacher_range
    document: dict[str, Any] = {
        "teacher_range": _errors(found, taught, taught.in_teacher_range),
        "beyond": _errors(found, taught, rest),
    }
    if taught.touching.any():
        document["contact"] = {
            "windows": int(taught.touching.sum()),
            "largest": float(found[taught.touching, :2].max()),
        }
    return document


def _assessed(student: Checkpoint, stars: Stars) -> Float32Array:
    network = trained_network(student).eval()
    starts = range(0, len(stars), network.windows_at_once)
    with torch.inference_mode():
        parts = [network.scores_and_deviations(stars[start : start + network.windows_at_once]) for start in starts]
    answers: Float32Array = torch.cat(parts).numpy()
    return answers


def _errors(found: Float32Array, taught: TaughtWindows, chosen: NDArray[np.bool_]) -> dict[str, Any]:
    wrong = np.abs(found[:, :2] - taught.symmetrised)[chosen].astype(float)
    single = (taught.images - taught.symmetrised[:, None])[chosen].astype(float)
    deviations = found[chosen, 2:]
    document: dict[str, Any] = {"windows": int(chosen.sum())}
    for column, question in enumerate(QUESTIONS if chosen.any() else ()):
        document[question] = {
            "mse": float((wrong[:, column] ** 2).mean()),
            "teacher_single_mse": float((single[..., column] ** 2).mean()),
            "spearman": rank_correlation(deviations[:, column], wrong[:, column]),
        }
    return document


def model_card(checkpoint: Checkpoint) -> str:
    """The README of a checkpoint that `train_reward.py` has trained; its `about` is what that writes."""
    about, sizes = checkpoint.about, checkpoint.config.sizes[1:-1]
    training, test = about["training"], about["test"]
    seeds = f"{training['seed']} to {training['seed'] + len(about['members']) - 1}"
    return f"""# The default reward network

An ensemble of {len(about["members"])} star networks (rounds of {" and ".join(map(str, sizes))} features) with \
{about["parameters"]:,} parameters together. It gives
Q1 and Q2 for the last second of a scene (three frames, one second apart): always within 0..1, the same for a scene and
its mirror image, and at most 0.05 where the robot touches a person, an object or a wall. It also says how far its
members are apart.

**What it learned from.** The published network's answers (Bachiller et al. 2021) to {about["windows"]["train"]:,}
windows of *simulated* scenes, the mean over four images of each: as it is, with walls listed the other way round, and
both mirrored. Rooms of 3 to 20 m with 0 to 30 people; robots driven well and badly at up to 1 m/s, and moved next to,
onto and into things. {_people_line(about)}

**How.** Mean squared error; Muon and AdamW, one cycle of {training["max_epochs"]} epochs in batches of \
{training["batch_size"]}, seeds {seeds}.
`python train_reward.py` repeats it.

**Errors** on {about["windows"]["test"]:,} windows of other simulated episodes: mean squared errors against the mean
of the teacher's four answers, beside those of its single answers; and Spearman's rank correlation between the members'
deviation and the absolute error. Each for Q1 and Q2.

| windows | number | error | teacher's single answers | deviation and error |
|---|---:|---:|---:|---:|
{_test_row("within the teacher's range", test["teacher_range"])}
{_test_row("beyond it", test["beyond"])}

The teacher's range is that in which its own answers agree: {_limits(TEACHER_RANGE.document())}.

{_genuine_lines(about)}
**Range of the training data**, beyond which a scene is marked as out of range: {_limits(about["range"])}.

**Licences.** The teacher is GPL-3.0 software, used to label; none of its weights are here. SocNav1 (Manso et al. 2020)
is CC-BY 4.0.

**What it is not.** Most of its training scores are a network's and not people's. For numbers to compare with the
literature use the published network.
"""


def _people_line(about: dict[str, Any]) -> str:
    people = about.get("people")
    if people is None:
        return "None of its scores are people's."
    return (
        f"SocNav1's {people['ratings']:,} training ratings by people (Q1 alone) are\n"
        f"{people['share']:.0%} of what it sees in an epoch."
    )


def _test_row(name: str, found: dict[str, Any]) -> str:
    if not found["windows"]:
        return f"| {name} | 0 | - | - | - |"
    questions = [found[question] for question in QUESTIONS]
    errors, single = (" / ".join(f"{each[key]:.5f}" for each in questions) for key in ("mse", "teacher_single_mse"))
    ranks = " / ".join("-" if each["spearman"] is None else f"{each['spearman']:.2f}" for each in questions)
    return f"| {name} | {found['windows']:,} | {errors} | {single} | {ranks} |"


def _genuine_lines(about: dict[str, Any]) -> str:
    lines = ""
    if "genuine" in about:
        found = about["genuine"]
        lines += (
            f"On {found['rows']} rows of genuine SocNav2 recordings, its mean absolute difference from that mean is "
            f"{found['q1_mae']:.4f} (Q1)\nand {found['q2_mae']:.4f} (Q2).\n\n"
        )
    if "people" in about:
        found = about["people"]
        lines += (
            f"On SocNav1's {found['development_ratings']:,} development ratings, the mean squared error of Q1 is "
            f"{found['development_mse']:.4f}; that of one\nperson against the mean of the others is "
            f"{found['human_mse']:.4f}.\n\n"
        )
    return lines


def _limits(limits: dict[str, list[float]]) -> str:
    units = {"extent": " m", "people": "", "objects": "", "goal": " m", "speed": " m/s", "turn": " rad/s"}
    return ", ".join(f"{name} {low:g} to {high:g}{units[name]}" for name, (low, high) in limits.items())
