"""What every agent is: an object with the `predict` of Stable-Baselines3's policies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import gymnasium as gym

Observation = dict[str, NDArray[np.float32]]
State = tuple[NDArray[Any], ...] | None


@runtime_checkable
class Policy(Protocol):
    """Chooses actions; the signature is the one of Stable-Baselines3's policies and algorithms."""

    def predict(
        self,
        observation: Any,
        state: State = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[NDArray[np.float32], State]:
        """Return the action for one observation, or one action each for a batch, and the next recurrent state.

        Args:
            observation: an `entities` observation, or one with a leading batch dimension on every entry.
            state: recurrent state; the agents of this package have none and pass it through.
            episode_start: (batch,) where an episode has just begun; unused without a state.
            deterministic: take the most probable action instead of drawing one.
        """
        ...


def act(
    policy: Policy, env: gym.Env[Any, Any], observation: Observation, deterministic: bool = True
) -> NDArray[np.float32]:
    """Return what an agent does in an environment; one that knows no sideways (the baselines) drives without it."""
    action, _ = policy.predict(observation, deterministic=deterministic)
    if env.action_space.shape == (3,) and action.shape == (2,):
        return np.insert(action, 1, 0.0)
    return action
