"""Training of an ensemble's members, each in a process of its own, and their union."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final

import joblib
import torch

from reward_model.base.files import replace_file
from reward_model.data.examples import Part
from reward_model.data.labelled_windows import LabelledWindows, data_digest
from reward_model.networks.checkpoint import Checkpoint, load_checkpoint, save_checkpoint
from reward_model.networks.registry import StarConfig
from reward_model.training.fit import Epoch, TrainingConfig
from reward_model.training.session import learn_windows

STATE_FILE: Final = "training_state.safetensors"
LOG_FILE: Final = "epochs.txt"
RUN_FILE: Final = "run.json"
_MEMBER: Final = "members."


def train_members(
    sizes: tuple[int, ...],
    config: TrainingConfig,
    parts: Mapping[Part, LabelledWindows],
    num_members: int,
    folder: Path,
    jobs: int = 1,
) -> Iterator[Checkpoint]:
    """Train star networks that differ in their seed; yields their checkpoints in order of completion.

    A member that is done is read from its folder, and one that was interrupted goes on, if its options and data are
    these.

    Args:
        parts: with a train and a development part
        folder: gets a folder for each member

    Raises:
        ValueError: If a folder has a member that was trained with other options or data, and as `learn_windows`.
    """
    yield from joblib.Parallel(n_jobs=jobs, return_as="generator_unordered")(
        joblib.delayed(_member)(
            StarConfig(sizes), replace(config, seed=config.seed + number), dict(parts), folder / f"member{number}"
        )
        for number in range(num_members)
    )


def united(members: Sequence[Checkpoint]) -> Checkpoint:
    """The ensemble of members that were trained alike; its `about` is the first one's, with all errors.

    Raises:
        ValueError: If the members' inputs are not standardised alike, as they are with the same training windows.
    """
    first, *others = members
    shared = {name: tensor for name, tensor in first.tensors.items() if not name.startswith(_MEMBER)}
    for other in others:
        if any(not torch.equal(other.tensors[name], tensor) for name, tensor in shared.items()):
            raise ValueError("members must have been trained on the same windows, their inputs differ")
    tensors = dict(shared)
    for number, member in enumerate(members):
        own = {name: tensor for name, tensor in member.tensors.items() if name.startswith(f"{_MEMBER}0.")}
        tensors |= {name.replace(f"{_MEMBER}0.", f"{_MEMBER}{number}.", 1): tensor for name, tensor in own.items()}
    config = StarConfig(first.config.sizes, len(members))
    about: dict[str, Any] = {
        **first.about,
        "members": [
            {key: member.about[key] for key in ("epochs", "best_epoch", "train_error", "development_error")}
            for member in members
        ],
        "parameters": sum(tensor.numel() for name, tensor in tensors.items() if tensor.is_floating_point()),
    }
    for key in ("epochs", "best_epoch", "train_error", "development_error"):
        about.pop(key)
    return Checkpoint(config, tensors, about)


def _run(network: StarConfig, config: TrainingConfig, parts: Mapping[Part, LabelledWindows]) -> dict[str, Any]:
    """What tells one member from another: its network, its options and its data."""
    data = {part: data_digest(windows) for part, windows in parts.items()}
    return {"network": network.document(), "training": asdict(config), "data": data}


def _member(
    network: StarConfig, config: TrainingConfig, parts: dict[Part, LabelledWindows], folder: Path
) -> Checkpoint:
    done = folder / "checkpoint"
    run = json.dumps(_run(network, config, parts))
    if not (folder / RUN_FILE).exists():
        folder.mkdir(parents=True, exist_ok=True)
        replace_file(folder / RUN_FILE, run.encode())
    elif (folder / RUN_FILE).read_text(encoding="utf-8") != run:
        raise ValueError(f"{folder}: holds a member with other options or data; delete it or choose another folder")
    if done.is_dir():
        return load_checkpoint(done)
    torch.set_num_threads(1)  # results must not depend on the number of jobs
    state, lines = folder / STATE_FILE, folder / LOG_FILE

    def after_epoch(epoch: Epoch) -> None:
        with lines.open("a", encoding="utf-8") as log:
            log.write(f"{epoch.number} {epoch.train_error:.6f} {epoch.development_error:.6f}\n")

    lines.unlink(missing_ok=True)
    trained = learn_windows(network, config, parts, after_epoch, state, resume=state.exists())
    save_checkpoint(done, trained)
    state.unlink(missing_ok=True)
    return trained
