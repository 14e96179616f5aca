"""Scenarios described in a YAML file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from socnav_env.config import EnvConfig
from socnav_env.config.checks import ConfigError
from socnav_env.layout import Layout
from socnav_env.scenarios.entries import SceneFile
from socnav_env.scenarios.layouts import draw_layout
from socnav_env.scenarios.schema import parse_scene


@dataclass(frozen=True)
class WrittenScenario:
    """A scenario from a YAML file; see `Scenario`."""

    name: str
    scene: SceneFile

    @classmethod
    def from_text(cls, text: str, name: str, file: str) -> Self:
        """Read a file's text. file: its name in errors. Raises `ConfigError` naming the place in the file."""
        return cls(name, parse_scene(text, file))

    @property
    def description(self) -> str:
        """The file's description."""
        return self.scene.description

    def adapt(self, config: EnvConfig) -> EnvConfig:
        """The configuration with the file's own settings."""
        if not self.scene.overrides:
            return config
        try:
            return EnvConfig.from_dict(_merged(config.to_dict(), self.scene.overrides))
        except ConfigError as error:
            raise ConfigError(f"{self.scene.file}: config: {error}") from None

    def draw(self, config: EnvConfig, rng: np.random.Generator) -> Layout:
        """Draw a layout from the file's ranges."""
        return draw_layout(self.scene, config, rng)


def _merged(values: Mapping[str, Any], overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Nested dicts in which the overrides take precedence."""
    merged = dict(values)
    for key, value in overrides.items():
        known = merged.get(key)
        merged[key] = _merged(known, value) if isinstance(known, Mapping) and isinstance(value, Mapping) else value
    return merged
