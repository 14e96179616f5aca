"""Versions that the bits of a simulated episode depend on, besides its configuration."""

from __future__ import annotations

from importlib.metadata import version
from typing import Final

SIMULATION_VERSION: Final = 1  # to be raised whenever the same scene and commands give another trajectory
LIBRARIES: Final = ("numba", "numpy", "pymunk")


def simulation_versions() -> dict[str, str]:
    """The versions in use, by name."""
    return {"simulation": str(SIMULATION_VERSION), **{name: version(name) for name in LIBRARIES}}
