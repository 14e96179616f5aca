"""Recordings on disk: all data to measure an episode, to draw it, and to simulate it again bit for bit.

A recording is one .npz file of plain arrays and a header in JSON. Nothing in it is ever unpickled, and everything is
checked when it is read.
"""

from __future__ import annotations

import io
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, SupportsFloat

import gymnasium as gym
import numpy as np

from reward_model.base.files import replace_file
from socnav_env.config import EnvConfig
from socnav_env.env import SocNavEnv
from socnav_env.recording.arrays import FORMAT, RecordingError, arrays_of, layout_of, read_arrays, trajectory_of
from socnav_env.trajectories.trajectory import Trajectory
from socnav_env.trajectories.versions import simulation_versions

FORMAT_VERSION: Final = 2  # 2: commands have three numbers
HEADER: Final = "header"
HEADER_KEYS: Final = {
    "format", "format_version", "versions", "config", "random_state", "relations", "outcome", "scorer"
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Recording:
    """An episode that can be simulated again.

    Attributes:
        random_state: of the world's generator before the warm-up
        scorer: name of the weights that gave the scores; None without scores
        versions: of everything that the simulated bits depend on, by name
        name: its name in error messages
    """

    trajectory: Trajectory
    config: EnvConfig
    random_state: dict[str, Any]
    scorer: str | None
    versions: dict[str, str]
    name: str = "recording"

    def generator(self) -> np.random.Generator:
        """A generator in the state with which the world was created."""
        bits = np.random.PCG64()
        bits.state = self.random_state  # type: ignore[assignment]  # NumPy types it by what it returns
        return np.random.Generator(bits)


class RecordTrajectory(gym.Wrapper[Any, Any, Any, Any], gym.utils.RecordConstructorArgs):
    """Writes a recording of every episode into a folder: PREFIX-000000.npz, PREFIX-000001.npz and so on.

    An episode that is broken off by `reset` or `close` is written too; it has no outcome. Recordings in the folder are
    kept: numbers continue after the highest. Environments that write at the same time need different prefixes.

    Args:
        folder: created if it is missing
        name_prefix: prefix of the file names

    Raises:
        ValueError: If the environment is not SocNav2-v0.
    """

    def __init__(self, env: gym.Env[Any, Any], folder: str | os.PathLike[str], name_prefix: str = "episode") -> None:
        gym.utils.RecordConstructorArgs.__init__(self, folder=folder, name_prefix=name_prefix)
        gym.Wrapper.__init__(self, env)
        _require_socnav(env)
        self._folder, self._prefix = Path(folder), name_prefix
        self._running = False

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; see Gymnasium."""
        self._finish()
        return super().reset(seed=seed, options=options)

    def step(self, action: Any) -> tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]:
        """Advance by one control period; see Gymnasium."""
        result = super().step(action)
        self._running = True
        if result[2] or result[3]:
            self._finish()
        return result

    def close(self) -> None:
        """Write an unfinished episode and close the environment."""
        self._finish()
        super().close()

    def _finish(self) -> None:
        if self._running:
            self._running = False
            write_recording(record_episode(self.env), self._next_path())

    def _next_path(self) -> Path:
        numbers = [path.stem.removeprefix(f"{self._prefix}-") for path in self._folder.glob(f"{self._prefix}-*.npz")]
        number = 1 + max((int(each) for each in numbers if each.isdecimal()), default=-1)
        return self._folder / f"{self._prefix}-{number:06}.npz"


def record_episode(env: gym.Env[Any, Any]) -> Recording:
    """The current or just ended episode of an environment, which may be wrapped.

    Raises:
        ValueError: If the environment is not SocNav2-v0.
        ResetNeeded: If it has no episode yet.
    """
    base = _require_socnav(env)
    scorer = base.reward.scorer
    return Recording(
        trajectory=base.trajectory,
        config=base.config,
        random_state=dict(base.world.random_state),
        scorer=None if scorer is None else scorer.name,
        versions=simulation_versions(),
    )


def write_recording(recording: Recording, path: str | os.PathLike[str]) -> None:
    """Write a recording; the file appears complete or not at all."""
    trajectory = recording.trajectory
    header = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "versions": recording.versions,
        "config": recording.config.to_dict(),
        "random_state": recording.random_state,
        "relations": trajectory.layout.interaction_relations,
        "outcome": trajectory.outcome,
        "scorer": recording.scorer,
    }
    encoded = np.frombuffer(json.dumps(header, allow_nan=False).encode(), dtype=np.uint8)
    arrays: dict[str, Any] = {HEADER: encoded, **arrays_of(trajectory)}
    content = io.BytesIO()
    np.savez_compressed(content, **arrays)
    replace_file(path, content.getvalue())


def read_recording(path: str | os.PathLike[str]) -> Recording:
    """Read a recording, whatever version simulated it.

    Raises:
        RecordingError: With one line naming the file, the error and the rule.
    """
    place = os.fspath(path)
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise RecordingError(f"{place}: cannot read it: {error.strerror or error}") from error
    arrays = read_arrays(content, place)
    header = _read_header(arrays, place)
    try:
        config = EnvConfig.from_dict(header["config"])
    except ValueError as error:
        raise RecordingError(f"{place}: config: {error}") from error
    layout = layout_of(arrays, header["relations"], place)
    recording = Recording(
        trajectory=trajectory_of(arrays, layout, config, header["outcome"], place),
        config=config,
        random_state=header["random_state"],
        scorer=header["scorer"],
        versions=header["versions"],
        name=place,
    )
    try:
        recording.generator()
    except (KeyError, TypeError, ValueError, OverflowError):
        raise RecordingError(f"{place}: random_state must be the state of a PCG64 generator") from None
    return recording


def _read_header(arrays: dict[str, Any], place: str) -> dict[str, Any]:
    header: Any = None
    if HEADER in arrays and arrays[HEADER].dtype == np.uint8:
        try:
            header = json.loads(arrays[HEADER].tobytes())
        except (ValueError, RecursionError):
            raise RecordingError(f"{place}: the header must be JSON") from None
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise RecordingError(f"{place}: must be a {FORMAT} file as RecordTrajectory writes it")
    if header.get("format_version") != FORMAT_VERSION:
        version = header.get("format_version")
        raise RecordingError(f"{place}: format_version must be {FORMAT_VERSION}, got {version!r}; record it again")
    if set(header) != HEADER_KEYS:
        wrong = ", ".join(sorted(set(header) ^ HEADER_KEYS))
        raise RecordingError(f"{place}: the header must have {', '.join(sorted(HEADER_KEYS))}; check {wrong}")
    _check_header_types(header, place)
    return header


def _check_header_types(header: dict[str, Any], place: str) -> None:
    texts = isinstance(header["versions"], dict) and all(isinstance(each, str) for each in header["versions"].values())
    if not texts:
        raise RecordingError(f"{place}: versions must give a text for each name")
    if not isinstance(header["random_state"], dict):
        raise RecordingError(f"{place}: random_state must be the state of a PCG64 generator")
    if not (header["scorer"] is None or isinstance(header["scorer"], str)):
        raise RecordingError(f"{place}: scorer must be a text or null, got {header['scorer']!r}")


def _require_socnav(env: gym.Env[Any, Any]) -> SocNavEnv:
    base = env.unwrapped
    if not isinstance(base, SocNavEnv):
        raise ValueError(f"only SocNav2-v0 can be recorded, got {type(base).__name__}")
    return base
