"""Windows with their scores, as training takes them: the only thing that it knows of a data set."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reward_model.base.arrays import Float32Array, IntArray
from reward_model.graph.frame import FrameGraph
from reward_model.graph.star import Stars


@dataclass(frozen=True, eq=False)
class LabelledWindows:
    """Windows and what they were scored.

    Attributes:
        windows: each one to three frames, newest first; `Stars` take a quarter of the memory
        scores: (num_windows, 2) Q1 and Q2 in 0..1, NaN where a question was not asked
        weights: (num_windows, 2) how much each score counts in training, all the same where there are none
    """

    windows: Sequence[Sequence[FrameGraph]]
    scores: Float32Array
    weights: Float32Array | None = None

    def __len__(self) -> int:
        return len(self.windows)

    def windows_at(self, places: IntArray) -> Sequence[Sequence[FrameGraph]]:
        """The windows at these places, in this order."""
        if isinstance(self.windows, Stars):
            return self.windows.taken(places)
        return [self.windows[place] for place in places.tolist()]


def joined(parts: Sequence[LabelledWindows]) -> LabelledWindows:
    """The windows of all parts as `Stars`, one after the other, without weights."""
    stars = Stars.joined([Stars.of_windows(part.windows) for part in parts])
    return LabelledWindows(stars, np.concatenate([part.scores for part in parts]))


def data_digest(data: LabelledWindows) -> str:
    """Tells one set of windows from another by its scores, weights and sizes."""
    digest = hashlib.sha256(data.scores.tobytes())
    digest.update(b"" if data.weights is None else data.weights.tobytes())
    sizes = data.windows.counts if isinstance(data.windows, Stars) else [sum(map(len, each)) for each in data.windows]
    digest.update(np.array(sizes).tobytes())
    return digest.hexdigest()[:16]
