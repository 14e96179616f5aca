"""What the bits of a simulated episode depend on besides its configuration."""

from __future__ import annotations

from importlib.metadata import version
from typing import Final

SIMULATION_VERSION: Final = 1  # to be raised whenever a scene and its commands come to lead somewhere else
LIBRARIES: Final = ("numba", "numpy", "pymunk")


def simulation_versions() -> dict[str, str]:
    """The versions in use, by name."""
    return {"simulation": str(SIMULATION_VERSION), **{name: version(name) for name in LIBRARIES}}
