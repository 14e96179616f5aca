"""Draws docs/gallery.md's pictures: every scenario as it begins, and the learned reward's heatmap under some.

python examples/gallery.py
"""

from __future__ import annotations

from pathlib import Path

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from PIL import Image

import socnav_env  # noqa: F401 registers SocNav2-v0
from socnav_env.env import SocNavEnv, action_of
from socnav_env.rendering.style import BACKGROUND, PANEL_HEIGHT
from socnav_env.scenarios import load_scenario, names
from socnav_env.simulated_data.drivers import DRIVERS

DOCS = Path(__file__).parents[1] / "docs"
IMAGES = DOCS / "images" / "gallery"
SIZE = 420  # pixels
EDGE = 12  # pixels of empty space that are kept
SEED = 3
HEATED = ("standing_group_in_the_way", "person_at_laptop", "frontal_approach", "crossing_crowd")
DRIVEN = 4.0  # s for which a polite driver drives before a heatmap is taken

INTRODUCTION = """# Gallery

Every scenario that ships, as seed {seed} begins it; the details differ from seed to seed. People who walk are blue,
those who stand violet, dotted lines join those who interact, and the star is the robot's goal.
`python examples/gallery.py` draws this page, [scenarios.md](scenarios.md) says how to write a scenario of your own.
"""
HEATMAPS = """
## What the learned reward makes of them

After {driven:g} s: Q2, were the robot elsewhere in the room and had driven the way it did, from red (0) to green (1).
The circles are intimate and personal space (0.45 m and 1.2 m). The window of `python -m socnav_env play` shows the same
with the keys h and p, `python -m socnav_env render clip.mp4 --heatmap --rings` a whole episode.
"""


def main() -> None:
    """Draw all and write the page."""
    IMAGES.mkdir(parents=True, exist_ok=True)
    text = INTRODUCTION.format(seed=SEED)
    for name in names():
        env = _begin(name, "sparse")
        _save(env.frame(), name)
        env.close()
        text += f"\n## {name}\n\n{' '.join(load_scenario(name).description.split())}\n\n![{name}]({_link(name)})\n"
    text += HEATMAPS.format(driven=DRIVEN)
    for name in HEATED:
        env = _begin(name, "learned")
        _drive(env)
        _save(env.frame(heatmap=True, rings=True), f"{name}_heatmap", panel=True)
        env.close()
        text += f"\n![{name}, heatmap]({_link(f'{name}_heatmap')})\n"
    (DOCS / "gallery.md").write_text(text, encoding="utf-8")


def _begin(name: str, reward: str) -> SocNavEnv:
    env = gym.make("SocNav2-v0", reward=reward, scenario=name, render_mode="rgb_array").unwrapped
    assert isinstance(env, SocNavEnv)
    env.reset(seed=SEED)
    return env


def _drive(env: SocNavEnv) -> None:
    random = np.random.default_rng(SEED)
    driver = DRIVERS["polite"](random)
    for _ in range(round(DRIVEN / env.config.control_period)):
        env.step(action_of(driver.command(env.world, random), env.config.robot))


def _save(picture: NDArray[np.uint8], name: str, panel: bool = False) -> None:
    """Write a picture, small, without the empty space above and below a long room.

    panel: whether the strip with the scores is kept
    """
    scene, strip = picture[:-PANEL_HEIGHT], picture[-PANEL_HEIGHT:]
    rows = np.flatnonzero((scene != BACKGROUND).any(axis=(1, 2)))
    scene = scene[max(rows[0] - EDGE, 0) : rows[-1] + EDGE]
    image = Image.fromarray(np.vstack([scene, strip]) if panel else scene)
    image = image.resize((SIZE, round(image.height * SIZE / image.width)), Image.Resampling.LANCZOS)
    image.save(IMAGES / f"{name}.png", optimize=True)


def _link(name: str) -> str:
    return f"images/gallery/{name}.png"


if __name__ == "__main__":
    main()
