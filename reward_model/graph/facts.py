"""Facts of a scene that tell whether a network has seen its like: `FACTS`, and the range of them in training data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from reward_model.base.arrays import FloatArray, Int32Array
from reward_model.base.numba import njit
from reward_model.graph.features import OWN
from reward_model.graph.frame import FrameGraph
from reward_model.graph.packing import views
from reward_model.graph.star import KINDS, WIDTHS, Stars

# Each fact, and how it is told to people.
_TEXTS: Final = {
    "extent": "room of {:.3g} m",
    "people": "{:.0f} people",
    "objects": "{:.0f} objects",
    "goal": "goal at {:.3g} m",
    "speed": "robot at {:.3g} m/s",
    "turn": "robot turning at {:.3g} rad/s",
}
FACTS: Final = tuple(_TEXTS)
"""Extent of the room [m], numbers of people and objects, distance of the goal [m], speed [m/s], turn rate [rad/s]."""

_TOLERANCE: Final = 1e-3  # relative, beyond the range
SPEED_UNIT: Final = 3.5 / 9.4  # m/s, of the advance feature, see `frame_kernels`
TURN_UNIT: Final = 4.0 / 10.32  # rad/s, of the turn feature


def facts_of(windows: Sequence[Sequence[FrameGraph]]) -> FloatArray:
    """The facts of windows' newest frames, (num_windows, 6)."""
    if isinstance(windows, Stars):
        return _facts_of_stars(windows)
    facts = np.empty((len(windows), len(FACTS)))
    for place, window in enumerate(windows):
        _fill_facts(window[0].words, facts[place])
    return facts


def _facts_of_stars(stars: Stars) -> FloatArray:
    goal, advance, turn = stars.rooms[:, 1], stars.rooms[:, 2], stars.rooms[:, WIDTHS["rooms"][0] + 1]
    people, objects = stars.counts[:, KINDS.index("people")], stars.counts[:, KINDS.index("objects")]
    moves = (10.0 * goal, SPEED_UNIT * np.abs(advance), TURN_UNIT * np.abs(turn))
    return np.column_stack([stars.surroundings[:, 3], people, objects, *moves]).astype(np.float64)


@njit
def _fill_facts(words: Int32Array, facts: FloatArray) -> None:
    frame = views(words)
    facts[:] = 0.0
    facts[0] = frame.surroundings[3]
    for node in range(len(frame.kinds)):
        kind = frame.kinds[node]
        if kind == 0:
            facts[1] += 1
        elif kind == 1:
            facts[2] += 1
        elif kind == 4:
            facts[3] = 10.0 * frame.lengths[node]
        elif kind == 2:
            facts[4] = abs(frame.features[node, OWN]) * SPEED_UNIT
            facts[5] = abs(frame.features[node, OWN + 1]) * TURN_UNIT


@dataclass(frozen=True)
class TrainingRange:
    """The least and the largest of each fact in a network's training data.

    Args:
        limits: pairs by the names in `FACTS`, all of them

    Raises:
        ValueError: For limits that are not such.
    """

    limits: Mapping[str, tuple[float, float]]

    def __post_init__(self) -> None:
        if set(self.limits) != set(FACTS):
            raise ValueError(f"a range must have {list(FACTS)}, got {sorted(self.limits)}")
        for name, pair in self.limits.items():
            if len(pair) != 2 or not pair[0] <= pair[1]:
                raise ValueError(f"range: {name} must be two numbers, the smaller first, got {pair}")

    @classmethod
    def of_facts(cls, facts: FloatArray) -> TrainingRange:
        """The range of facts (num_windows, 6), of which there is at least one."""
        low, high = facts.min(axis=0).tolist(), facts.max(axis=0).tolist()
        return cls(dict(zip(FACTS, zip(low, high, strict=True), strict=True)))

    @classmethod
    def of_document(cls, document: Mapping[str, Any]) -> TrainingRange:
        """The inverse of `document`."""
        return cls({name: (float(low), float(high)) for name, (low, high) in document.items()})

    def document(self) -> dict[str, list[float]]:
        """The limits as JSON has them."""
        return {name: [round(low, 4), round(high, 4)] for name, (low, high) in self.limits.items()}

    def contains(self, facts: FloatArray) -> NDArray[np.bool_]:
        """Whether each row of facts (num_windows, 6) lies within the range."""
        low, high = self.bounds
        inside: NDArray[np.bool_] = np.all((facts >= low) & (facts <= high), axis=1)
        return inside

    def exceeded(self, facts: FloatArray) -> list[tuple[str, ...]]:
        """What is out of range about each row of facts (num_windows, 6), in words such as `room of 30 m`."""
        low, high = self.bounds
        outside = (facts < low) | (facts > high)
        return [
            tuple(_TEXTS[name].format(value) for name, value, out in zip(FACTS, row, marks, strict=True) if out)
            for row, marks in zip(facts.tolist(), outside.tolist(), strict=True)
        ]

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """The least and the largest values (6,) that count as within the range."""
        limits = np.array([self.limits[name] for name in FACTS])
        return limits[:, 0] * (1 - _TOLERANCE), limits[:, 1] * (1 + _TOLERANCE)


def training_range(about: Mapping[str, Any]) -> TrainingRange | None:
    """The range in a checkpoint's `about`, None where it has none.

    Raises:
        ValueError: If it is not one.
    """
    document = about.get("range")
    try:
        return None if document is None else TrainingRange.of_document(document)
    except (ValueError, TypeError, AttributeError) as error:
        raise ValueError(f"about.range cannot be read ({error})") from None
