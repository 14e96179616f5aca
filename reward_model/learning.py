"""Training and evaluating networks on data sets: what the commands `train` and `evaluate` do."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Literal

import numpy as np
from rich.console import Console
from rich.progress import Progress, TaskID

from reward_model.cache import cached_examples
from reward_model.checkpoint import Checkpoint, NetworkConfig, save_checkpoint
from reward_model.data_files import DataFiles, find_files, read_files
from reward_model.dataset import Augmentation
from reward_model.evaluation import error_histogram, report
from reward_model.examples import (
    PARTS,
    DatasetError,
    Examples,
    Part,
    check_apart,
    examples_of,
    part_of_scenes,
    split_by_scene,
)
from reward_model.files import replace_file
from reward_model.graph import Float32Array
from reward_model.networks import trainable_network, usable_device
from reward_model.ratings import QUESTIONS
from reward_model.scorer import SocialScorer
from reward_model.training import Epoch, TrainingConfig, errors, fit

STATE_FILE: Final = "training_state.safetensors"
CURVE_FILE: Final = "curve.csv"
TENSORBOARD_FOLDER: Final = "tensorboard"
_SCORED_AT_ONCE: Final = 100  # windows between two moves of the progress bar


@dataclass(frozen=True)
class DataConfig:
    """Which scenes to use.

    path: see `reward_model.data_files.find_files`
    augmentation: of the training part
    held_out: where the data is not split, the share of scenes for development, and for the test
    split_seed: which scenes these are
    cache: where graphs are kept for the next time, nowhere where None
    """

    path: Path
    augmentation: Augmentation = "mirror"
    held_out: float = 0.1
    split_seed: int = 0
    cache: Path | None = None


def load_parts(data: DataConfig, progress: Progress) -> dict[Part, Examples]:
    """Read a data set and split it where it is not split.

    Raises `DatasetError` and `ScenarioError` for what is wrong with it.
    """
    files = find_files(data.path)
    if "all" in files:
        return split_by_scene(_read(data, files, "all", data.augmentation, progress), data.held_out, data.split_seed)
    for part in ("train", "development"):
        if part not in files:
            raise DatasetError(f"{data.path}: a data set that is split must have a {part} part, got {sorted(files)}")
    parts: dict[Part, Examples] = {
        part: _read(data, files, part, data.augmentation if part == "train" else "none", progress)
        for part in PARTS
        if part in files
    }
    check_apart(parts)
    return parts


def load_part(data: DataConfig, part: Part | Literal["all"], progress: Progress) -> Examples:
    """Read one part of a data set, or all of it, without augmented copies. Raises as `load_parts`."""
    files = find_files(data.path)
    if part in files:
        return _read(data, files, part, "none", progress)
    if "all" in files and part != "all":
        return part_of_scenes(_read(data, files, "all", "none", progress), part, data.held_out, data.split_seed)
    if part != "all":
        raise DatasetError(f"{data.path}: has no {part} part, got {sorted(files)}")
    everything = tuple(path for paths in files.values() for path in paths)
    return _read(data, {"all": everything}, "all", "none", progress)


def train(
    data: DataConfig,
    network_config: NetworkConfig,
    config: TrainingConfig,
    output: Path,
    resume: bool = False,
    clips_alike: bool = True,
) -> dict[str, Any]:
    """Train a network and save it as a checkpoint in `output`, beside its curve and logs.

    resume: go on with the training that was interrupted there
    clips_alike: every clip weighs the same, however many people scored it
    Returns what the checkpoint says about itself. Raises `ValueError`s for what is wrong with data or options.
    """
    usable_device(network_config, config.device)
    if not resume and (output / STATE_FILE).exists():
        raise DatasetError(f"{output}: holds a training already; resume it or choose another output")
    console = Console(stderr=True)
    with Progress(console=console) as progress:
        parts = load_parts(data, progress)
        network = trainable_network(network_config, config.seed)
        bar = progress.add_task("train", total=config.max_epochs)
        with _Log(output, progress, bar) as log:
            history = fit(
                network,
                parts["train"].labelled(clips_alike),
                parts["development"].labelled(),
                config,
                log,
                output / STATE_FILE,
                resume,
            )
    about = {
        "data": data.path.name,
        "questions": _asked(parts["train"]),
        "examples": {part: len(examples) for part, examples in parts.items()},
        "augmentation": data.augmentation,
        "training": asdict(config),
        "epochs": len(history),
        "development_error": min(epoch.development_error for epoch in history),
        "parameters": sum(parameter.numel() for parameter in network.parameters()),
    }
    if "test" in parts:
        found = errors(network, parts["test"].labelled(), config.device).tolist()
        about["test_error"] = {q: e for q, e in zip(QUESTIONS, found, strict=True) if not np.isnan(e)}
    state = {name: tensor.cpu() for name, tensor in network.state_dict().items()}
    save_checkpoint(output, Checkpoint(network_config, state, about))
    for question in sorted(set(QUESTIONS) - set(_asked(parts["train"]))):
        console.print(f"[yellow]nobody was asked for {question.upper()}: this network's {question} means nothing")
    return about


def evaluate(
    scorer: SocialScorer, data: DataConfig, part: Part | Literal["all"], output: Path | None = None
) -> dict[str, Any]:
    """Compare a network with people's scores.

    output: a folder for `evaluation.json` and a histogram of absolute errors a question
    Returns the report. Raises as `load_part`.
    """
    with Progress(console=Console(stderr=True), transient=True) as progress:
        examples = load_part(data, part, progress)
        answers = _answers(scorer, examples, progress)
    found = {"weights": scorer.name, "data": str(data.path), "part": part, "examples": len(examples)}
    document = found | report(answers, examples.scores, examples.ratings())
    if output is not None:
        replace_file(output / "evaluation.json", (json.dumps(document, indent=2) + "\n").encode())
        for question in _asked(examples):
            image = error_histogram(answers, examples.scores, question)
            replace_file(output / f"absolute_errors_{question}.png", image)
    return document


class _Log:
    """Tells of every epoch: on the terminal, in a CSV file and in TensorBoard."""

    def __init__(self, folder: Path, progress: Progress, bar: TaskID) -> None:
        from torch.utils.tensorboard import SummaryWriter

        self._folder, self._progress, self._bar = folder, progress, bar
        self._epochs: list[Epoch] = []
        folder.mkdir(parents=True, exist_ok=True)
        # A resumed training tells its epochs anew; what was logged before is void.
        self._writer = SummaryWriter(str(folder / TENSORBOARD_FOLDER), purge_step=0)

    def __enter__(self) -> Callable[[Epoch], None]:
        return self._after_epoch

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._writer.close()

    def _after_epoch(self, epoch: Epoch) -> None:
        self._epochs.append(epoch)
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        table.writerow(["epoch", "train_error", "development_error"])
        table.writerows(self._epochs)
        replace_file(self._folder / CURVE_FILE, text.getvalue().encode())
        for name in ("train", "development"):
            value = getattr(epoch, f"{name}_error")
            self._writer.add_scalar(f"error/{name}", value, epoch.number)
        line = f"train, errors {epoch.train_error:.5f} / {epoch.development_error:.5f}"
        self._progress.update(self._bar, advance=1, description=line)


def _read(
    data: DataConfig,
    files: DataFiles,
    part: Part | Literal["all"],
    augmentation: Augmentation,
    progress: Progress,
) -> Examples:
    bar = progress.add_task(f"read {part}", total=len(files[part]))

    def make() -> Examples:
        return examples_of(read_files(files[part], lambda: progress.advance(bar)), augmentation)

    found = make() if data.cache is None else cached_examples(files[part], augmentation, data.cache, make)
    progress.update(bar, completed=len(files[part]))
    return found


def _answers(scorer: SocialScorer, examples: Examples, progress: Progress) -> Float32Array:
    bar = progress.add_task("score", total=len(examples))
    answers = []
    for start in range(0, len(examples), _SCORED_AT_ONCE):
        answers.append(scorer.score_windows(examples.windows[start : start + _SCORED_AT_ONCE]))
        progress.advance(bar, len(answers[-1]))
    return np.concatenate(answers)


def _asked(examples: Examples) -> list[str]:
    return [question for column, question in enumerate(QUESTIONS) if not np.isnan(examples.scores[:, column]).all()]
