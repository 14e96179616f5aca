"""Large sets of simulated windows with a teacher's scores, kept on disk shard by shard so that work can be resumed."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Final

import joblib
import numpy as np

from reward_model.base.files import replace_file
from reward_model.data.labelling import NUM_IMAGES, image_scores
from reward_model.data.taught import TaughtWindows
from reward_model.graph.star import Stars
from reward_model.scorer import SocialScorer, load_scorer
from socnav_env.simulated_data.windows import Episode, wide_episode, windows_of_episodes

EPISODES_PER_SHARD: Final = 250
WIDE: Final = "wide-1"  # changed with the scenes, the rows of `Stars` and the files
_MANIFEST: Final = "manifest.json"


class ShardError(ValueError):
    """A folder of shards cannot be used. The message names it and the remedy."""


def simulate_shards(
    folder: Path,
    num_shards: int,
    seed: int,
    teacher: str,
    jobs: int = 1,
    episode: Episode = wide_episode,
    scenes: str = WIDE,
) -> Iterator[int]:
    """Write the shards that `folder` lacks, and give back how many are there, from time to time.

    A shard has the windows of `EPISODES_PER_SHARD` episodes, of the wide range about 2,600. Every episode has a seed of
    its own, so that a set does not depend on `jobs`, the number of processes, and a larger one begins with the smaller.

    Args:
        teacher: name or path of the weights that score; see `load_scorer`
        episode: simulates an episode
        scenes: the name of these episodes, by which a folder is recognised

    Raises:
        ShardError: If the folder's shards are of another seed, teacher or version.
        CheckpointError: As `load_scorer`.
    """
    load_scorer(teacher)  # where there are none, say so before processes start
    _check_manifest(folder, {"version": scenes, "seed": seed, "teacher": teacher})
    missing = [number for number in range(num_shards) if not _path(folder, number).exists()]
    yield num_shards - len(missing)
    done = joblib.Parallel(n_jobs=jobs, return_as="generator_unordered")(
        joblib.delayed(_write_shard)(folder, number, seed, teacher, episode) for number in missing
    )
    for count, _ in enumerate(done, num_shards - len(missing) + 1):
        yield count


def load_shards(folder: Path, num_shards: int) -> TaughtWindows:
    """The windows of the first shards of a folder that `simulate_shards` has filled.

    Raises:
        ShardError: If a shard is missing or cannot be read.
    """
    parts, images = [], [np.zeros((0, NUM_IMAGES, 2), dtype=np.float32)]
    for number in range(num_shards):
        path = _path(folder, number)
        try:
            with np.load(path) as arrays:
                parts.append(Stars.of_arrays(arrays))
                images.append(arrays["images"])
        except (OSError, ValueError, KeyError, EOFError) as error:
            raise ShardError(f"{path}: not a readable shard ({error}); delete it and simulate again") from None
    return TaughtWindows(Stars.joined(parts), np.concatenate(images))


def _path(folder: Path, number: int) -> Path:
    return folder / f"{number:05}.npz"


def _check_manifest(folder: Path, manifest: dict[str, object]) -> None:
    path = folder / _MANIFEST
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        replace_file(path, json.dumps(manifest).encode())
        return
    try:
        found = json.loads(path.read_text())
    except ValueError as error:
        raise ShardError(f"{path}: not readable as JSON ({error}); delete the folder") from None
    if found != manifest:
        raise ShardError(f"{folder}: holds shards of {found}, not of {manifest}; choose another folder")


def _write_shard(folder: Path, number: int, seed: int, teacher: str, episode: Episode) -> None:
    first = number * EPISODES_PER_SHARD
    windows = windows_of_episodes(episode, seed, range(first, first + EPISODES_PER_SHARD))
    scorer = _scorer(teacher)
    images = [image_scores(scorer, windows[start : start + 500]) for start in range(0, len(windows), 500)]
    content = io.BytesIO()
    np.savez(content, images=np.concatenate(images), **Stars.of_windows(windows).arrays())
    replace_file(_path(folder, number), content.getvalue())


@cache
def _scorer(teacher: str) -> SocialScorer:
    return load_scorer(teacher)
