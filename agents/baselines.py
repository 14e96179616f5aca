"""Agents that learn nothing, to compare with: `random` and `straight`. Both read the `entities` observation."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.policy import Policy, State

TURN_IN_PLACE = 0.3  # rad, straight drives on only when the goal lies within this of its nose
TURN_GAIN = 4.0  # turn command per radian of bearing, before it is clipped to the full rate


class RandomPolicy:
    """Draws uniform actions.

    What it draws is a function of its seed and the observation alone, so that an episode comes out the same
    whatever episodes were played before it, in whichever process.
    """

    def __init__(self, seed: int = 0) -> None:
        self.seed = seed

    def predict(
        self,
        observation: Any,
        state: State = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[NDArray[np.float32], State]:
        """Return actions in -1..1, (2,) or (batch, 2)."""
        arrays = [np.ascontiguousarray(observation[key]) for key in sorted(observation)]
        if np.ndim(observation["goal"]) == 1:
            return self._draw(arrays), state
        rows = zip(*arrays, strict=True)
        return np.stack([self._draw(list(row)) for row in rows]), state

    def _draw(self, arrays: list[NDArray[Any]]) -> NDArray[np.float32]:
        digest = 0
        for array in arrays:
            digest = zlib.crc32(array.tobytes(), digest)
        return np.random.default_rng([self.seed, digest]).uniform(-1.0, 1.0, 2).astype(np.float32)


class StraightPolicy:
    """Turns on the spot until it faces the goal, then drives straight at it, whoever stands in between."""

    def predict(
        self,
        observation: Any,
        state: State = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[NDArray[np.float32], State]:
        """Return actions in -1..1, (2,) or (batch, 2)."""
        goal = np.asarray(observation["goal"])
        bearing = np.arctan2(goal[..., 1], goal[..., 0])
        forward = np.where(np.abs(bearing) < TURN_IN_PLACE, 1.0, 0.0)
        turn = np.clip(TURN_GAIN * bearing, -1.0, 1.0)
        return np.stack([forward, turn], axis=-1).astype(np.float32), state


BASELINES: dict[str, Callable[[], Policy]] = {"random": RandomPolicy, "straight": StraightPolicy}
