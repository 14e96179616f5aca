"""Labelled sequences as windows of frames, with the scores, scenes, clips and raters for splits and training."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from typing import Final, Literal, overload

import numpy as np

from reward_model.base.arrays import Float32Array, IntArray
from reward_model.data.augmentation import VARIANTS, Augmentation, judged_moments, judged_window, moments
from reward_model.data.labelled_windows import LabelledWindows
from reward_model.graph.frame import FrameGraph
from reward_model.graph.windows import all_frames, sequence_frames
from reward_model.scenes.ratings import Ratings
from reward_model.scenes.scene import LabelledSequence, SceneSequence

Part = Literal["train", "development", "test"]
PARTS: Final[tuple[Part, ...]] = ("train", "development", "test")


class DatasetError(ValueError):
    """A set of labelled scenes cannot be used. The message names the place, the rule and the remedy."""


@dataclass(frozen=True, eq=False)
class Examples:
    """Windows, their scores and their origin; augmented copies follow their original.

    Attributes:
        windows: each one to three frames, newest first
        scores: (num_examples, 2) Q1 and Q2 in 0..1, NaN where the question was not asked
        scenes: name of the scene; splits keep a scene in one part
        clips: name of the clip, see `Ratings`
        raters: name of the rater, empty where unknown
        variants: (num_examples,) 0 for an original, above 0 for its augmented copies
    """

    windows: Sequence[Sequence[FrameGraph]]
    scores: Float32Array
    scenes: tuple[str, ...]
    clips: tuple[str, ...]
    raters: tuple[str, ...]
    variants: IntArray

    def __len__(self) -> int:
        return len(self.scenes)

    def chosen(self, indices: Iterable[int]) -> Examples:
        """The examples at these indices."""
        rows = list(indices)
        return Examples(
            _Chosen(self.windows, rows),
            self.scores[rows],
            tuple(self.scenes[row] for row in rows),
            tuple(self.clips[row] for row in rows),
            tuple(self.raters[row] for row in rows),
            self.variants[rows],
        )

    def originals(self) -> Examples:
        """The examples without augmented copies."""
        return self.chosen(np.flatnonzero(self.variants == 0).tolist())

    def ratings(self) -> Ratings:
        """The ratings of the examples."""
        return Ratings(self.clips, self.raters, self.scores.astype(np.float64))

    def newest(self, num_frames: int) -> Examples:
        """The same examples with the newest `num_frames` frames of each window at most."""
        return replace(self, windows=_Newest(self.windows, num_frames))

    def labelled(self) -> LabelledWindows:
        """All windows with their own scores, for evaluation."""
        return LabelledWindows(self.windows, self.scores)

    def labelled_clips(self, alike: bool) -> LabelledWindows:
        """The windows for training: each variant of a clip once, with the mean of its scores.

        The squared error of the mean has the same gradient as the mean of the squared errors, for less work.

        Args:
            alike: clips have equal weights, however many people scored them; else scores have
        """
        rows: dict[tuple[str, int], list[int]] = {}
        for row, key in enumerate(zip(self.clips, self.variants.tolist(), strict=True)):
            rows.setdefault(key, []).append(row)
        known = ~np.isnan(self.scores)
        counts = np.array([known[same].sum(axis=0) for same in rows.values()], dtype=np.float32)
        totals = np.array([np.nansum(self.scores[same], axis=0) for same in rows.values()], dtype=np.float32)
        means = np.divide(totals, counts, out=np.full_like(totals, np.nan), where=counts > 0)
        windows = self.chosen(same[0] for same in rows.values()).windows
        return LabelledWindows(windows, means, None if alike else counts)


class _View(Sequence[Sequence[FrameGraph]], ABC):
    """Windows made from others on access: all of them may exceed the memory."""

    @abstractmethod
    def window(self, index: int) -> Sequence[FrameGraph]:
        """The window at an index."""

    @overload
    def __getitem__(self, index: int) -> Sequence[FrameGraph]: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Sequence[FrameGraph]]: ...
    def __getitem__(self, index: int | slice) -> Sequence[FrameGraph] | Sequence[Sequence[FrameGraph]]:
        if isinstance(index, slice):
            return [self.window(each) for each in range(*index.indices(len(self)))]
        return self.window(index)


class _Chosen(_View):
    """Some of the windows."""

    def __init__(self, windows: Sequence[Sequence[FrameGraph]], rows: list[int]) -> None:
        self._windows, self._rows = windows, rows

    def __len__(self) -> int:
        return len(self._rows)

    def window(self, index: int) -> Sequence[FrameGraph]:
        return self._windows[self._rows[index]]


class _Newest(_View):
    """The newest frames of the windows."""

    def __init__(self, windows: Sequence[Sequence[FrameGraph]], num_frames: int) -> None:
        self._windows, self._num_frames = windows, num_frames

    def __len__(self) -> int:
        return len(self._windows)

    def window(self, index: int) -> Sequence[FrameGraph]:
        return self._windows[index][: self._num_frames]


def examples_of(labelled: Iterable[LabelledSequence], augmentation: Augmentation = "none") -> Examples:
    """The examples of labelled sequences. Raises `ScenarioError` as `sequence_frames` does."""
    windows: list[Sequence[FrameGraph]] = []
    scores: list[tuple[float, float]] = []
    names: list[tuple[str, str, str]] = []  # not the sequences: they take many times the memory of their frames
    variants: list[int] = []
    for each in labelled:
        found = _moments(each.sequence) if augmentation == "moments" else _copies(each.sequence, augmentation)
        windows += found
        scores += [(math.nan if each.q1 is None else each.q1, math.nan if each.q2 is None else each.q2)] * len(found)
        names += [(each.scene, each.sequence.name, each.rater)] * len(found)
        variants += range(len(found))
    scenes, clips, raters = zip(*names, strict=True) if names else ((), (), ())
    return Examples(
        windows,
        np.array(scores, dtype=np.float32).reshape(-1, 2),
        scenes,
        clips,
        raters,
        np.array(variants, dtype=np.int64),
    )


def _copies(sequence: SceneSequence, augmentation: Augmentation) -> list[list[FrameGraph]]:
    window = judged_window(sequence)
    return [sequence_frames(change(window)) for change in VARIANTS[augmentation]]


def _moments(sequence: SceneSequence) -> list[list[FrameGraph]]:
    """The windows of a sequence's moments, which share their frames."""
    sequence = judged_moments(sequence)
    newest_first = all_frames(sequence)
    windows = moments([snapshot.timestamp for snapshot in sequence])
    return [[newest_first[-1 - index] for index in window] for window in windows]


def split_by_scene(examples: Examples, held_out: float, seed: int = 0) -> dict[Part, Examples]:
    """Split examples into parts; each scene, with all its ratings and augmented copies, is in one part.

    A scene's part depends on its name and the seed alone: it stays the same when other scenes are added.

    Args:
        held_out: the share of scenes for development, and for the test. Augmented copies are for training only.

    Raises:
        DatasetError: If a part would be empty.
    """
    return {
        part: chosen if part == "train" else chosen.originals()
        for part, chosen in ((part, part_of_scenes(examples, part, held_out, seed)) for part in PARTS)
    }


def part_of_scenes(examples: Examples, part: Part, held_out: float, seed: int = 0) -> Examples:
    """One part of `split_by_scene`, augmented copies included. Raises `DatasetError` where it is empty."""
    if not 0 < held_out < 0.5:
        raise DatasetError(f"held_out must lie between 0 and 0.5, got {held_out}")
    scenes = {scene: _part(scene, held_out, seed) == part for scene in set(examples.scenes)}
    if not any(scenes.values()):
        raise DatasetError(
            f"no scene falls into the {part} part of {len(scenes)} scenes; "
            "raise held_out, choose another seed or give more scenes"
        )
    return examples.chosen(row for row, scene in enumerate(examples.scenes) if scenes[scene])


def split_in_two(examples: Examples, held_out: float, seed: int = 0) -> dict[Part, Examples]:
    """As `split_by_scene`, with the test part's scenes used for training: for networks tested on other data."""
    parts = split_by_scene(examples, held_out, seed)
    kept = set(parts["development"].scenes)
    rest = examples.chosen(row for row, scene in enumerate(examples.scenes) if scene not in kept)
    return {"train": rest, "development": parts["development"]}


def check_apart(parts: dict[Part, Examples]) -> None:
    """Raise `DatasetError` where a scene is in two parts."""
    seen: dict[str, Part] = {}
    for part, examples in parts.items():
        for scene in examples.scenes:
            if seen.setdefault(scene, part) != part:
                raise DatasetError(f"scene {scene!r} must be in one part only, it is in {seen[scene]} and {part}")


def _part(scene: str, held_out: float, seed: int) -> Part:
    place = int.from_bytes(sha256(f"{seed} {scene}".encode()).digest()[:8]) / 2**64
    if place < held_out:
        return "test"
    return "development" if place < 2 * held_out else "train"
