"""Scores of a network as labels, which another network can learn: of windows, and in recordings as people's are."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Final

import joblib
import numpy as np

from reward_model.base.arrays import Float32Array
from reward_model.base.files import replace_file
from reward_model.data.examples import DatasetError
from reward_model.data.files import find_files
from reward_model.data.labelled_windows import LabelledWindows
from reward_model.graph.frame import FrameGraph
from reward_model.graph.windows import mirrored_frame, reversed_walls
from reward_model.scenes.scene import LabelledSequence, ScenarioError
from reward_model.scenes.socnav2_json import encode_socnav2, read_socnav2
from reward_model.scorer import SocialScorer, load_scorer

_TOGETHER: Final = 100  # recordings or windows that are scored at a time


def label_windows(
    scorer: SocialScorer, windows: Sequence[Sequence[FrameGraph]], report: Callable[[int], object] = lambda count: None
) -> LabelledWindows:
    """Score windows, as many at a time as keep a progress bar moving.

    Args:
        report: is told how many have been scored since the last time
    """
    scores = [np.zeros((0, 2), dtype=np.float32)]
    for start in range(0, len(windows), _TOGETHER):
        scores.append(scorer.score_windows(windows[start : start + _TOGETHER]))
        report(len(scores[-1]))
    return LabelledWindows(windows, np.concatenate(scores))


NUM_IMAGES: Final = 4


def image_scores(scorer: SocialScorer, windows: Sequence[Sequence[FrameGraph]]) -> Float32Array:
    """Scores (num_windows, 4, 2) of each window and its images: walls reversed, mirrored, mirrored and walls reversed.

    The four show one scene: people's scores do not depend on which side is left, nor on the end from which a wall is
    listed. The scores of a network that was not made symmetric do; their mean is the symmetrised network's answer.
    """
    images: list[list[list[FrameGraph]]] = [
        [list(window) for window in windows],
        [[reversed_walls(frame) for frame in window] for window in windows],
        [[mirrored_frame(frame) for frame in window] for window in windows],
        [[mirrored_frame(frame, turn_walls=True) for frame in window] for window in windows],
    ]
    return np.stack([scorer.score_windows(each) for each in images], axis=1)


def unlabelled_files(data: Path, output: Path) -> tuple[Path, ...]:
    """The recordings of a list or folder that have no labelled copy in `output` yet.

    Raises:
        DatasetError: As `find_files` does, where they are not recordings, or where `output` is their own folder.
    """
    files = tuple(path for paths in find_files(data).values() for path in paths)
    if others := [path for path in files if path.suffix != ".json"]:
        raise DatasetError(f"{others[0]}: only recordings (*.json) can be labelled")
    if any(path.parent.resolve() == output.resolve() for path in files):
        raise DatasetError(f"{output}: labelled copies need a folder of their own, the recordings lie there")
    return tuple(path for path in files if not (output / path.name).exists())


def label_files(files: tuple[Path, ...], output: Path, weights: str, jobs: int = 1) -> Iterator[int]:
    """Write labelled copies, scores clipped to 0..1; gives back how many, from time to time.

    A copy appears complete or not at all. Raises `CheckpointError` as `load_scorer`, `ScenarioError` for a file that
    is no recording and `OSError` where a copy cannot be written; those that are there stay.
    """
    load_scorer(weights)  # where there are none, say so before processes start
    chunks = [files[start : start + _TOGETHER] for start in range(0, len(files), _TOGETHER)]
    yield from joblib.Parallel(n_jobs=jobs, return_as="generator_unordered")(
        joblib.delayed(_label)(chunk, output, weights) for chunk in chunks
    )


def _label(files: tuple[Path, ...], output: Path, weights: str) -> int:
    scorer: SocialScorer = load_scorer(weights)
    sequences = [read_socnav2(path) for path in files]
    try:
        scores = scorer.score_batch(sequences).clip(0, 1).tolist()
    except ScenarioError as error:
        raise ScenarioError(f"{files[0].parent}: {error}") from None
    for path, sequence, (q1, q2) in zip(files, sequences, scores, strict=True):
        replace_file(output / path.name, encode_socnav2(LabelledSequence(sequence, q1, q2)))
    return len(files)
