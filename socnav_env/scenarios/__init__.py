"""Scenarios: named scenes, scenes in files of one's own, and SocNav2 recordings to go on from.

`gym.make("SocNav2-v0", scenario="blind_corner")`. docs/scenarios.md describes the files.
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
    """Where episodes begin."""

    @property
    def name(self) -> str:
        """What it goes by."""

    @property
    def description(self) -> str:
        """What happens in it, in a sentence or two."""

    def adapt(self, config: EnvConfig) -> EnvConfig:
        """The configuration with what the scenario sets itself. Raises `ConfigError` where the two do not go."""

    def draw(self, config: EnvConfig, rng: np.random.Generator) -> Layout:
        """What an episode begins with, `config` being adapted. Raises `ConfigError` where nothing fits."""


def names() -> tuple[str, ...]:
    """The scenarios that ship, in alphabetical order."""
    return tuple(sorted(each.name.removesuffix(".yaml") for each in _FOLDER.iterdir() if each.name.endswith(".yaml")))


def load_scenario(scenario: str | os.PathLike[str] | Scenario) -> Scenario:
    """Return the scenario of a name or in a file, .yaml as docs/scenarios.md says or .json as SocNav2 has it.

    Raises `ConfigError` or `ScenarioError`, both `ValueError`s, with one line: what is wrong and where.
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
