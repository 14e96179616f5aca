"""The entry point of `gym.make_vec("SocNav2-v0", ...)`."""

from __future__ import annotations

from typing import Any

from gymnasium.vector import VectorEnv

from socnav_env.vector.env import SocNavVectorEnv
from socnav_env.vector.workers_env import SocNavWorkerVectorEnv


def make_vector_env(num_envs: int = 1, num_workers: int | None = None, **arguments: Any) -> VectorEnv[Any, Any, Any]:
    """Make what `gym.make_vec("SocNav2-v0", ...)` returns.

    Args:
        num_envs, arguments: see `SocNavVectorEnv`, which this is in the process at hand
        num_workers: how many processes share the worlds; where given, this is a `SocNavWorkerVectorEnv`
    """
    if num_workers is None:
        return SocNavVectorEnv(num_envs, **arguments)
    return SocNavWorkerVectorEnv(num_envs, num_workers, **arguments)
