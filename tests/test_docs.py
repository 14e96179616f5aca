"""What the documents name exists, and what exists is named."""

import re
from pathlib import Path

import numpy as np
import pytest

from socnav_env.config import EnvConfig
from socnav_env.config.reference import entries
from socnav_env.env import SocNavEnv
from socnav_env.observations import OBSERVATIONS, FlatObservation, GraphObservation
from socnav_env.rewards import REWARDS

DOCS = Path(__file__).parents[1] / "docs"
TEXT = (DOCS / "environment.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", [*OBSERVATIONS, *REWARDS])
def test_every_observation_and_reward_is_described(name: str) -> None:
    assert f"`{name}`" in TEXT


def test_the_keys_named_exist_and_those_of_robot_and_sensors_are_all_named() -> None:
    keys = {entry.key for entry in entries(EnvConfig())}
    named = set(re.findall(r"`((?:robot|sensors)\.\w+)`", TEXT))
    assert named <= keys
    assert {key for key in keys if key.startswith(("robot.", "sensors."))} <= named


def test_the_info_is_described() -> None:
    env = SocNavEnv(reward="crowdnav", config=EnvConfig(time_limit=0.2))
    env.reset(seed=0)
    for key in env.step(np.zeros(2))[-1]:
        assert f"`{key}`" in TEXT


def test_the_sizes_are_right() -> None:
    graph = GraphObservation(EnvConfig()).space()
    nodes, edges = graph["nodes_mask"].shape[0], graph["edges_mask"].shape[0]
    numbers = sum(box.shape[0] for box in graph.values())
    assert f"{nodes} nodes and {edges:,} edges, {numbers:,} numbers" in TEXT
    assert f"{FlatObservation(EnvConfig()).size} numbers by default" in TEXT


PROJECT = DOCS.parent
FOLDERS = ("reward_model", "socnav_env", "agents", "benchmarks", "docs")
PAGES = [
    *sorted(PROJECT.glob("*.md")),
    *(page for name in FOLDERS for page in sorted((PROJECT / name).glob("**/*.md"))),
]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(PROJECT)))
def test_links_and_paths_lead_somewhere(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    links = [link.split("#")[0] for link in re.findall(r"\]\(([^)\s]+)\)", text) if "://" not in link]
    assert [link for link in links if link and not (page.parent / link).exists()] == []
    paths = re.findall(r"((?:[a-z_]+/)+[a-z0-9_]+\.(?:py|md|toml))\b", text)  # NAME.py is yet to be written
    packages = [PROJECT, *(PROJECT / name for name in ("reward_model", "socnav_env", "agents")), page.parent]
    assert [path for path in paths if not any((folder / path).exists() for folder in packages)] == []
