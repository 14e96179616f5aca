"""The commands of `python -m socnav_env` that show something: pictures and films, and the window to play in."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import tyro

from reward_model.base.files import replace_file
from socnav_env.config import EnvConfig

if TYPE_CHECKING:
    from socnav_env.recording.files import Recording

PICTURE_KINDS: Final = (".gif", ".mp4", ".png")
FILM_FPS: Final = 60
MOST_FPS: Final = 240

Output = Annotated[Path | None, tyro.conf.arg(aliases=["-o"])]


@dataclass(frozen=True)
class Render:
    """Draw an episode: a .gif or .mp4 shows all of it, a .png how it ended.

    `render clip.gif` plays one. `render FILE -o clip.mp4` draws one that RecordTrajectory has recorded.
    """

    file: tyro.conf.Positional[Path]
    """Picture file, .gif, .mp4 or .png; with -o: the recording to draw."""
    output: Output = None
    """Picture file of a recording."""
    driver: str = "polite"
    """Who drives: goal, polite, chaser, fugitive, reverser, joystick or stander."""
    seed: int = 0
    """Seed of the scene and of the driver."""
    reward: str = "learned"
    """Reward by name; a learned one shows its scores."""
    weights: str = "default"
    """Weights of a learned reward and of the heatmap: default, published or a checkpoint folder."""
    env_config: Path | None = None
    """JSON file with the environment's configuration, where it differs from the default."""
    scenario: str | None = None
    """Where to begin: a name that `scenarios` lists, a .yaml file, or a SocNav2 .json file."""
    fps: float | None = None
    """Pictures a second of simulated time; default: 60 for .mp4, one each control period for .gif."""
    heatmap: bool = False
    """Lay under the scene what Q2 would be were the robot elsewhere."""
    rings: bool = False
    """Draw everyone's intimate and personal space."""

    def run(self) -> int:
        """Play or read, draw, write the picture, and print how the episode ended."""
        picture = self.file if self.output is None else self.output
        kind = picture.suffix.lower()
        if kind not in PICTURE_KINDS:
            raise ValueError(f"output must end in {', '.join(PICTURE_KINDS)}, got {str(picture)!r}")
        if self.seed < 0:
            raise ValueError(f"seed must not be negative, got {self.seed}")
        if self.fps is not None and not 0 < self.fps <= MOST_FPS:
            raise ValueError(f"fps must be above 0 and at most {MOST_FPS}, got {self.fps:g}")
        from PIL.Image import fromarray

        from reward_model.scorer import load_scorer
        from socnav_env.recording.films import Look, draw_recording, encode_film, encode_pictures

        recording = self._recording()
        fps = self.fps or (FILM_FPS if kind == ".mp4" else 1 / recording.config.control_period)
        look = Look(fps, load_scorer(self.weights) if self.heatmap else None, self.rings)
        pictures = draw_recording(recording, kind != ".png", look)
        if kind == ".mp4":
            content = encode_film(pictures, fps)
        else:
            content = encode_pictures([fromarray(each) for each in pictures], 1 / fps)
        replace_file(picture, content)
        print(f"{picture}: {recording.trajectory.outcome or 'broken off'}")
        return 0

    def _recording(self) -> Recording:
        if self.output is not None:
            from socnav_env.recording.files import read_recording

            return read_recording(self.file)
        from socnav_env.env import SocNavEnv
        from socnav_env.recording.films import play

        config = EnvConfig() if self.env_config is None else read_env_config(self.env_config)
        env = SocNavEnv(self.reward, config=config, weights=self.weights, scenario=self.scenario)
        return play(env, self.driver, self.seed)


@dataclass(frozen=True)
class Play:
    """Drive the robot yourself: arrow keys or a joystick; a and d go sideways where the robot can.

    h lays the learned reward's heatmap under the scene, p draws personal space, the space bar begins the next episode
    once one has ended, escape ends it all.
    """

    scenario: str | None = None
    """Where to begin: a name that `scenarios` lists, a .yaml file, or a SocNav2 .json file."""
    record: Path | None = None
    """File for a recording of the first episode, .npz; later ones are written beside it, with numbers."""
    seed: int = 0
    """Seed of the first episode; each one after it has the next."""
    reward: str = "learned"
    """Reward by name; a learned one shows its scores."""
    weights: str = "default"
    """Weights of a learned reward: default, published or a checkpoint folder."""
    env_config: Path | None = None
    """JSON file with the environment's configuration, where it differs from the default."""

    def run(self) -> int:
        """Open the window and play until it is closed; print how each episode ended."""
        if self.seed < 0:
            raise ValueError(f"seed must not be negative, got {self.seed}")
        if self.record is not None and self.record.suffix.lower() != ".npz":
            raise ValueError(f"record must end in .npz, got {str(self.record)!r}")
        from socnav_env.env import SocNavEnv
        from socnav_env.recording.hand_driving import play_by_hand

        config = EnvConfig() if self.env_config is None else read_env_config(self.env_config)
        env = SocNavEnv(self.reward, config=config, render_mode="human", weights=self.weights, scenario=self.scenario)
        for number, outcome in enumerate(play_by_hand(env, self.seed, self.record)):
            print(f"seed {self.seed + number}: {outcome or 'broken off'}", flush=True)
        return 0


def read_env_config(path: Path) -> EnvConfig:
    """Read an environment's configuration from a JSON file.

    Raises:
        ValueError: Naming the file where it is not JSON or breaks a rule of the configuration.
    """
    try:
        return EnvConfig.from_dict(json.loads(path.read_text(encoding="utf-8")))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
