"""Observations: one class per kind, each with `space()` and `observe()`, and a registry.

Everything is in the robot's frame (x forward, y left, counter-clockwise, SI units) and clipped to its box.

May import `simulation` and what that is built of.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from socnav_env.observations.base import Observation, RowObservation, WindowObservation
from socnav_env.observations.entities import ENTITY_WIDTHS, EntitiesObservation
from socnav_env.observations.flat import FlatObservation
from socnav_env.observations.graph import GraphObservation
from socnav_env.observations.lidar import LidarObservation

if TYPE_CHECKING:
    from socnav_env.config import EnvConfig

__all__ = [
    "ENTITY_WIDTHS",
    "OBSERVATIONS",
    "AnyObservation",
    "EntitiesObservation",
    "FlatObservation",
    "GraphObservation",
    "LidarObservation",
    "Observation",
    "RowObservation",
    "WindowObservation",
    "make_observation",
]

AnyObservation = Observation | WindowObservation

OBSERVATIONS: dict[str, Callable[[EnvConfig], AnyObservation]] = {
    "entities": EntitiesObservation,
    "flat": FlatObservation,
    "lidar": LidarObservation,
    "graph": GraphObservation,
}


def make_observation(observation: str | AnyObservation, config: EnvConfig) -> AnyObservation:
    """Return the observation of this name, or the given one if it is an `Observation` already.

    Raises:
        ValueError: For an unknown name and for an object that is not an observation.
    """
    if isinstance(observation, str):
        if observation not in OBSERVATIONS:
            valid = ", ".join(OBSERVATIONS)
            raise ValueError(f"observation must be one of {valid} or an Observation object, got {observation!r}")
        return OBSERVATIONS[observation](config)
    if not isinstance(observation, (Observation, WindowObservation)):
        raise ValueError(
            f"observation must be one of {', '.join(OBSERVATIONS)} or an object with space() and "
            f"observe(world, time_left), got {type(observation).__name__}"
        )
    return observation
