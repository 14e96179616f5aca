"""Pictures of played or recorded episodes: a film, a GIF, or a PNG of the end."""

from __future__ import annotations

import io
import math
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from PIL.Image import Dither, Image, new

from reward_model.analysis.heatmap import WindowScorer
from reward_model.base.progress import watched
from socnav_env.env import SocNavEnv, action_of
from socnav_env.recording.files import Recording, record_episode
from socnav_env.recording.replay import recorded_sequences
from socnav_env.rendering import Renderer
from socnav_env.rendering.heat_overlay import heat_of
from socnav_env.rendering.playback import view_at
from socnav_env.rendering.view import HeatOverlay
from socnav_env.simulated_data.drivers import DRIVERS

GIF_COLORS: Final = 128
PALETTE_PICTURES: Final = 12  # pictures of an episode from which its palette is made
LAST_PICTURE: Final = 2000  # ms for which a GIF shows its last picture

Picture = NDArray[np.uint8]  # (height, width, 3)


@dataclass(frozen=True)
class Look:
    """Options for drawing an episode.

    Attributes:
        fps: pictures per second of simulated time; None: one per step
        scorer: scorer of the heatmap, drawn under the scene for every step; None: no heatmap
        rings: whether the intimate and personal space of everyone is drawn
    """

    fps: float | None = None
    scorer: WindowScorer | None = None
    rings: bool = False


def play(env: SocNavEnv, driver: str, seed: int) -> Recording:
    """Play one episode with the driver of this name."""
    if driver not in DRIVERS:
        raise ValueError(f"driver must be one of {', '.join(DRIVERS)}, got {driver!r}")
    env.reset(seed=seed)
    random = np.random.default_rng(seed)
    active_driver = DRIVERS[driver](random)
    for _ in watched(range(env.config.max_steps), "playing"):
        command = active_driver.command(env.world, random)
        info = env.step(action_of(command, env.config.robot))[-1]
        if info["outcome"] is not None:
            break
    return record_episode(env)


def draw_recording(recording: Recording, whole: bool, look: Look) -> Iterator[Picture]:
    """Draw a recorded episode: all of it, or its end alone."""
    renderer, trajectory, period = Renderer(), recording.trajectory, recording.config.control_period
    heats = _heats(recording, look.scorer, whole)
    end = len(trajectory) * period
    times = np.append(np.arange(0.0, end - 1e-6, 1 / (look.fps or 1 / period)), end)[0 if whole else -1 :]
    for time in watched(times.tolist(), "drawing"):
        heat = heats[min(math.floor(time / period + 1e-6), len(heats) - 1)] if heats else None
        yield renderer.draw(replace(view_at(trajectory, time, recording.config), heat=heat, rings=look.rings))


def _heats(recording: Recording, scorer: WindowScorer | None, whole: bool) -> list[HeatOverlay]:
    """The heatmap after each step, the start included, or the last one alone."""
    if scorer is None:
        return []
    room = recording.trajectory.layout.room
    sequences = recorded_sequences(recording)[0 if whole else -1 :]
    return [heat_of(scorer, sequence, room) for sequence in watched(sequences, "scoring")]


def encode_film(pictures: Iterable[Picture], fps: float) -> bytes:
    """Pictures as an H.264 film. Raises `ValueError` where the package that encodes it is missing."""
    try:
        import imageio_ffmpeg
    except ImportError:
        raise ValueError('an .mp4 needs an encoder: pip install "socnav2[video]"') from None
    with tempfile.TemporaryDirectory() as folder:
        file, writer = Path(folder) / "film.mp4", None
        for picture in pictures:
            if writer is None:
                height, width = picture.shape[:2]
                writer = imageio_ffmpeg.write_frames(str(file), (width, height), fps=fps, macro_block_size=2)
                writer.send(None)
            writer.send(picture)
        assert writer is not None, "an episode has at least one picture"
        writer.close()
        return file.read_bytes()


def encode_pictures(pictures: Sequence[Image], seconds_each: float) -> bytes:
    """One picture as PNG, several as an endless GIF that pauses on the last one."""
    content = io.BytesIO()
    if len(pictures) == 1:
        pictures[0].save(content, format="PNG")
        return content.getvalue()
    palette = _common_palette(pictures)  # one palette for all frames: faster, and nothing flickers
    first, *others = [picture.quantize(palette=palette, dither=Dither.NONE) for picture in pictures]
    durations = [round(1000 * seconds_each)] * len(others) + [LAST_PICTURE]
    first.save(content, format="GIF", save_all=True, append_images=others, duration=durations, loop=0)
    return content.getvalue()


def _common_palette(pictures: Sequence[Image]) -> Image:
    """A palette for the pictures of one episode, from some of them spread over it."""
    chosen = pictures[:: -(len(pictures) // -PALETTE_PICTURES)]
    width, height = pictures[0].size
    column = new("RGB", (width, height * len(chosen)))
    for index, picture in enumerate(chosen):
        column.paste(picture, (0, index * height))
    return column.quantize(GIF_COLORS)
