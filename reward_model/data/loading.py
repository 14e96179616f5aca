"""Loading of a data set's examples, part by part, for training, search and evaluation."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from rich.progress import Progress

from reward_model.data.augmentation import Augmentation, judged_moments, judged_window
from reward_model.data.cache import cached_examples
from reward_model.data.examples import (
    PARTS,
    DatasetError,
    Examples,
    Part,
    check_apart,
    examples_of,
    part_of_scenes,
    split_by_scene,
    split_in_two,
)
from reward_model.data.files import DataFiles, find_files, read_files
from reward_model.graph.features import NUM_FRAMES
from reward_model.networks.checkpoint import WEIGHTS_FILE
from reward_model.scorer import load_scorer, weights_path


@dataclass(frozen=True)
class DataConfig:
    """A data set, its split and its augmentation.

    Attributes:
        path: file or folder, see `reward_model.data.files.find_files`
        augmentation: augmentation of the training part
        held_out: the share of scenes for development, and for the test, where the data is not split
        split_seed: seed of that split
        cache: folder of the cache of graphs, or None for no cache
        frames: number of frames of each window, the newest; 1 is enough where nothing moves
        teacher: weights of the network that labelled the data, if one did: it then scores augmented copies, too, as its
            scores of a scene and its copies may differ; where None, a copy has its original's scores
        test: another data set, all of which is the test part; where the first is not split, its own test scenes are
            then used for training
    """

    path: Path
    augmentation: Augmentation = "mirror"
    held_out: float = 0.1
    split_seed: int = 0
    cache: Path | None = None
    frames: int = NUM_FRAMES
    test: Path | None = None
    teacher: str | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.frames <= NUM_FRAMES:
            raise DatasetError(f"frames must be 1 to {NUM_FRAMES}, got {self.frames}")
        if self.augmentation == "moments" and self.teacher is None:
            raise DatasetError("augmentation moments needs a teacher: a clip's scores are not those of earlier moments")


def load_parts(data: DataConfig, progress: Progress) -> dict[Part, Examples]:
    """Read a data set by parts; split it where it has none.

    Raises `DatasetError` and `ScenarioError` where it is not valid.
    """
    files = find_files(data.path)
    for part in ("train", "development"):
        if "all" not in files and part not in files:
            raise DatasetError(f"{data.path}: a data set that is split must have a {part} part, got {sorted(files)}")
    if "all" in files:
        split = split_by_scene if data.test is None else split_in_two
        parts = split(_read(data, files, "all", data.augmentation, progress), data.held_out, data.split_seed)
    else:
        parts = {
            part: _read(data, files, part, data.augmentation if part == "train" else "none", progress)
            for part in PARTS
            if part in files and (part != "test" or data.test is None)
        }
    if data.test is not None:
        parts["test"] = load_part(replace(data, path=data.test, test=None), "all", progress)
    check_apart(parts)
    return parts


def load_part(data: DataConfig, part: Part | Literal["all"], progress: Progress) -> Examples:
    """Read one part of a data set, or all of it, without augmented copies. Raises as `load_parts`."""
    files = find_files(data.path)
    if part in files:
        return _read(data, files, part, "none", progress)
    if "all" in files and part != "all":
        return part_of_scenes(_read(data, files, "all", "none", progress), part, data.held_out, data.split_seed)
    if part != "all":
        raise DatasetError(f"{data.path}: has no {part} part, got {sorted(files)}")
    everything = tuple(path for paths in files.values() for path in paths)
    return _read(data, {"all": everything}, "all", "none", progress)


def _read(
    data: DataConfig,
    files: DataFiles,
    part: Part | Literal["all"],
    augmentation: Augmentation,
    progress: Progress,
) -> Examples:
    bar = progress.add_task(f"read {part}", total=len(files[part]))

    def make() -> Examples:
        needed = judged_moments if augmentation == "moments" else judged_window
        examples = examples_of(read_files(files[part], lambda: progress.advance(bar), needed), augmentation)
        return examples if data.teacher is None else _with_scores_of(examples, data.teacher)

    variety = augmentation if data.teacher is None else f"{augmentation} {_digest(data.teacher)}"
    found = make() if data.cache is None else cached_examples(files[part], variety, data.cache, make)
    progress.update(bar, completed=len(files[part]))
    return found if data.frames == NUM_FRAMES else found.newest(data.frames)


def _with_scores_of(examples: Examples, teacher: str) -> Examples:
    """The examples with the teacher's scores of augmented copies, for the questions that were asked."""
    copies = np.flatnonzero(examples.variants > 0)
    scores = examples.scores.copy()
    predictions = load_scorer(teacher).score_windows(examples.chosen(copies.tolist()).windows).clip(0, 1)
    scores[copies] = np.where(np.isnan(scores[copies]), np.nan, predictions)
    return replace(examples, scores=scores)


def _digest(teacher: str) -> str:
    return hashlib.sha256((weights_path(teacher) / WEIGHTS_FILE).read_bytes()).hexdigest()[:16]
