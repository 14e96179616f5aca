"""Scenarios: named scenes, scenes in a user's files, and SocNav2 recordings to continue.

`gym.make("SocNav2-v0", scenario="blind_corner")`. docs/scenarios.md describes the files.

May import `trajectories`, `scenes` and what they are built of.
"""

from __future__ import annotations

import os
from importlib.resources import files
from pathlib import Path
from typing import Final, Protocol, runtime_checkable

import numpy as np

from socnav_env.config import EnvConfig
from socnav_env.config.checks import ConfigError
from socnav_env.layout import Layout

YAML_FILES: Final = (".yaml", ".yml")
JSON_FILES: Final = (".json",)
_FOLDER: Final = files("socnav_env.scenarios") / "data"


@runtime_checkable
class Scenario(Protocol):
    """The protocol of a scenario: it draws the layouts of episodes."""

    @property
    def name(self) -> str:
        """The scenario's name."""

    @property
    def description(self) -> str:
        """A description in a sentence or two."""

    def adapt(self, config: EnvConfig) -> EnvConfig:
        """The configuration with the scenario's own settings. Raises `ConfigError` where the two conflict."""

    def draw(self, config: EnvConfig, rng: np.random.Generator) -> Layout:
        """Draw an episode's layout; `config` must be adapted. Raises `ConfigError` where no draw fits."""


def names() -> tuple[str, ...]:
    """The names of the scenarios in this package, in alphabetical order."""
    return tuple(sorted(each.name.removesuffix(".yaml") for each in _FOLDER.iterdir() if each.name.endswith(".yaml")))


def load_scenario(scenario: str | os.PathLike[str] | Scenario) -> Scenario:
    """Return a scenario by its name or from a file: .yaml as in docs/scenarios.md or .json as in SocNav2.

    Raises:
        ConfigError: Or `ScenarioError`, both `ValueError`s, with one line naming the error and its place.
    """
    if not isinstance(scenario, str | os.PathLike):
        if isinstance(scenario, Scenario):
            return scenario
        raise ConfigError(f"scenario must be a name, a file or a Scenario, got {type(scenario).__name__}")
    place = os.fspath(scenario)
    if place in names():
        from socnav_env.scenarios.written import WrittenScenario

        text = (_FOLDER / f"{place}.yaml").read_text(encoding="utf-8")
        return WrittenScenario.from_text(text, place, f"scenario {place}")
    return _load_file(Path(place))


def _load_file(path: Path) -> Scenario:
    if path.suffix.lower() in YAML_FILES:
        from reward_model.scenes.json_fields import read_text_file
        from socnav_env.scenarios.written import WrittenScenario

        return WrittenScenario.from_text(read_text_file(path), path.stem, str(path))
    if path.suffix.lower() in JSON_FILES:
        from socnav_env.scenarios.recorded import RecordedScenario

        return RecordedScenario.from_file(path)
    raise ConfigError(
        f"scenario must be one of {', '.join(names())}, or a file that ends in .yaml or .json, got {str(path)!r}"
    )
