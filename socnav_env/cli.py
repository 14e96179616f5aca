"""The commands of `python -m socnav_env`. Each loads what it needs when it runs, so that `--help` is quick."""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import tyro
from rich.console import Console
from rich.progress import track

from reward_model.files import replace_file
from socnav_env.config import EnvConfig

if TYPE_CHECKING:
    from PIL.Image import Image

    from socnav_env.env import SocNavEnv

USER_ERROR: Final = 2
INTERRUPTED: Final = 130
PICTURE_KINDS: Final = (".gif", ".png")
GIF_COLORS: Final = 128
PALETTE_PICTURES: Final = 12  # of an episode, from which its palette is made
LAST_PICTURE: Final = 2000  # ms for which a GIF rests on its last picture


@dataclass(frozen=True)
class Render:
    """Play one episode and draw it: a .gif shows all of it, a .png how it ended."""

    output: tyro.conf.Positional[Path]
    """Picture file, .gif or .png."""
    driver: str = "polite"
    """Who drives: goal, polite, chaser, fugitive, reverser, joystick or stander."""
    seed: int = 0
    """Seed of the scene and of the driver."""
    reward: str = "learned"
    """Reward by name; a learned one shows its scores."""
    weights: str = "default"
    """Weights of a learned reward: default, published or a checkpoint folder."""
    env_config: Path | None = None
    """JSON file with the environment's configuration, where it differs from the default."""

    def run(self) -> None:
        """Play, draw, write the picture, and print how the episode ended."""
        if self.output.suffix.lower() not in PICTURE_KINDS:
            raise ValueError(f"output must end in {' or '.join(PICTURE_KINDS)}, got {str(self.output)!r}")
        if self.seed < 0:
            raise ValueError(f"seed must not be negative, got {self.seed}")
        from socnav_env.env import SocNavEnv

        config = EnvConfig() if self.env_config is None else read_env_config(self.env_config)
        env = SocNavEnv(self.reward, config=config, render_mode="rgb_array", weights=self.weights)
        whole = self.output.suffix.lower() == ".gif"
        pictures, outcome = play(env, self.driver, self.seed, whole)
        replace_file(self.output, encode_pictures(pictures, config.control_period))
        print(f"{self.output}: {outcome}")


COMMANDS: Final[dict[str, Callable[..., Render]]] = {"render": Render}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status: 0, 2 for bad input, 130 when interrupted."""
    command = tyro.extras.subcommand_cli_from_dict(COMMANDS, prog="python -m socnav_env", args=arguments)
    try:
        command.run()
    except (ValueError, OSError) as error:
        print("\n".join(f"socnav_env: {line}" for line in str(error).splitlines()), file=sys.stderr)
        return USER_ERROR
    except KeyboardInterrupt:
        print("socnav_env: interrupted", file=sys.stderr)
        return INTERRUPTED
    return 0


def read_env_config(path: Path) -> EnvConfig:
    """Read an environment's configuration from a JSON file.

    Raises `ValueError` naming the file where it is not JSON or breaks a rule of the configuration.
    """
    try:
        return EnvConfig.from_dict(json.loads(path.read_text(encoding="utf-8")))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def play(env: SocNavEnv, driver: str, seed: int, whole: bool) -> tuple[list[Image], str]:
    """Play one episode under a driver of this name; returns pictures, all or only the last, and how it ended."""
    import numpy as np
    from PIL.Image import fromarray

    from socnav_env.drivers import DRIVERS
    from socnav_env.env import action_of

    if driver not in DRIVERS:
        raise ValueError(f"driver must be one of {', '.join(DRIVERS)}, got {driver!r}")
    env.reset(seed=seed)
    random = np.random.default_rng(seed)
    at_the_wheel = DRIVERS[driver](random)
    pictures = []
    console = Console(stderr=True)
    steps = range(env.config.max_steps)
    for _ in track(steps, "playing", console=console, transient=True, disable=not console.is_terminal):
        if whole:
            pictures.append(fromarray(env.frame()))
        command = at_the_wheel.command(env.world, random)
        info = env.step(action_of(command, env.config.robot))[-1]
        if info["outcome"] is not None:
            break
    return [*pictures, fromarray(env.frame())], info["outcome"]


def encode_pictures(pictures: Sequence[Image], seconds_each: float) -> bytes:
    """One picture as PNG, several as an endless GIF that rests on its last one."""
    from PIL.Image import Dither

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
    from PIL.Image import new

    chosen = pictures[:: -(len(pictures) // -PALETTE_PICTURES)]
    width, height = pictures[0].size
    column = new("RGB", (width, height * len(chosen)))
    for index, picture in enumerate(chosen):
        column.paste(picture, (0, index * height))
    return column.quantize(GIF_COLORS)
