"""Gymnasium wrappers for agents that need another form of the environment."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any, Final

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

SPEEDS: Final = (-0.5, 0.0, 0.5, 1.0)
TURNS: Final = (-1.0, -0.5, 0.0, 0.5, 1.0)
SIDEWAYS: Final = (-0.5, 0.0, 0.5)


class DiscreteActions(gym.ActionWrapper[Any, Any, Any], gym.utils.RecordConstructorArgs):
    """Offers a grid of actions by number, for agents such as DQN that choose one of a few.

    The action space is `Discrete(n)`; action i asks for `table[i]`, (n, 2) forward and turn or, of a holonomic robot,
    (n, 3) forward, left and turn. Rows count through turns first, then sideways, then speeds: with 5 turns, action
    5 * s + t is `speeds[s]` and `turns[t]`. By default there are 20 actions, 60 for a holonomic robot.

    Args:
        speeds, turns: shares of the top speed and of the top turn rate, -1..1
        sideways: of the top speed to the left, -1..1; only for a holonomic robot

    Raises:
        ValueError: If a share is none, and where actions are not those of SocNav2-v0.
    """

    def __init__(
        self,
        env: gym.Env[Any, Any],
        speeds: Sequence[float] = SPEEDS,
        turns: Sequence[float] = TURNS,
        sideways: Sequence[float] = SIDEWAYS,
    ) -> None:
        gym.utils.RecordConstructorArgs.__init__(self, speeds=speeds, turns=turns, sideways=sideways)
        gym.ActionWrapper.__init__(self, env)
        axes = {"speeds": speeds, "sideways": sideways, "turns": turns}
        if not (isinstance(env.action_space, spaces.Box) and env.action_space.shape in ((2,), (3,))):
            raise ValueError(f"DiscreteActions needs SocNav2-v0's box of actions, got {env.action_space}")
        if env.action_space.shape == (2,):
            del axes["sideways"]
        for name, shares in axes.items():
            if not (len(shares) and all(math.isfinite(share) and -1 <= share <= 1 for share in shares)):
                raise ValueError(f"{name} must be at least one number from -1 to 1, got {tuple(shares)}")
        self.table: NDArray[np.float32] = np.array(list(itertools.product(*axes.values())), dtype=np.float32)
        self.action_space = spaces.Discrete(len(self.table))

    def action(self, action: Any) -> NDArray[np.float32]:
        """Return what action number `action` asks for, in memory of its own."""
        if not self.action_space.contains(action):
            raise ValueError(f"action must be a whole number from 0 to {len(self.table) - 1}, got {action!r}")
        chosen: NDArray[np.float32] = self.table[int(action)].copy()
        return chosen
