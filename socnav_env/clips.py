"""Episodes as pictures: played for the occasion, or recorded before; as a GIF or, how they ended, as a PNG."""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from typing import Final, TypeVar

import numpy as np
from PIL.Image import Dither, Image, fromarray, new
from rich.console import Console
from rich.progress import track

from socnav_env.drivers import DRIVERS
from socnav_env.env import SocNavEnv, action_of
from socnav_env.playback import view_of
from socnav_env.recording import Recording
from socnav_env.rendering import Renderer

GIF_COLORS: Final = 128
PALETTE_PICTURES: Final = 12  # of an episode, from which its palette is made
LAST_PICTURE: Final = 2000  # ms for which a GIF rests on its last picture

Item = TypeVar("Item")


def play(env: SocNavEnv, driver: str, seed: int, whole: bool) -> tuple[list[Image], str]:
    """Play one episode under a driver of this name; returns pictures, all or only the last, and how it ended."""
    if driver not in DRIVERS:
        raise ValueError(f"driver must be one of {', '.join(DRIVERS)}, got {driver!r}")
    env.reset(seed=seed)
    random = np.random.default_rng(seed)
    at_the_wheel = DRIVERS[driver](random)
    pictures = []
    for _ in _watched(range(env.config.max_steps), "playing"):
        if whole:
            pictures.append(fromarray(env.frame()))
        command = at_the_wheel.command(env.world, random)
        info = env.step(action_of(command, env.config.robot))[-1]
        if info["outcome"] is not None:
            break
    return [*pictures, fromarray(env.frame())], info["outcome"]


def draw_recording(recording: Recording, whole: bool) -> list[Image]:
    """Draw a recorded episode: pictures of all its steps, or only of the last."""
    renderer, trajectory = Renderer(), recording.trajectory
    rows = range(len(trajectory) + 1)[0 if whole else -1 :]
    return [fromarray(renderer.draw(view_of(trajectory, row, recording.config))) for row in _watched(rows, "drawing")]


def encode_pictures(pictures: Sequence[Image], seconds_each: float) -> bytes:
    """One picture as PNG, several as an endless GIF that rests on its last one."""
    content = io.BytesIO()
    if len(pictures) == 1:
        pictures[0].save(content, format="PNG")
        return content.getvalue()
    palette = _common_palette(pictures)  # one for all frames: quicker, and nothing flickers
    first, *others = [picture.quantize(palette=palette, dither=Dither.NONE) for picture in pictures]
    durations = [round(1000 * seconds_each)] * len(others) + [LAST_PICTURE]
    first.save(content, format="GIF", save_all=True, append_images=others, duration=durations, loop=0)
    return content.getvalue()


def _common_palette(pictures: Sequence[Image]) -> Image:
    """A palette for pictures of one episode, from some of them spread over it."""
    chosen = pictures[:: -(len(pictures) // -PALETTE_PICTURES)]
    width, height = pictures[0].size
    column = new("RGB", (width, height * len(chosen)))
    for index, picture in enumerate(chosen):
        column.paste(picture, (0, index * height))
    return column.quantize(GIF_COLORS)


def _watched(items: Sequence[Item], what: str) -> Iterable[Item]:
    """The same items, with a progress bar where someone watches."""
    console = Console(stderr=True)
    return track(items, what, console=console, transient=True, disable=not console.is_terminal)
