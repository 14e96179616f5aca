"""Training and evaluation of networks on data sets, for the commands `train` and `evaluate`."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Literal

import numpy as np
from rich.progress import Progress

from reward_model.analysis.evaluation import error_histogram, report
from reward_model.base.files import replace_file
from reward_model.base.progress import progress_bars
from reward_model.data.examples import DatasetError, Examples, Part
from reward_model.data.labelled_windows import LabelledWindows
from reward_model.data.labelling import label_windows
from reward_model.data.loading import DataConfig, load_part, load_parts
from reward_model.graph.facts import TrainingRange, facts_of
from reward_model.networks.building import trainable_network, usable_device
from reward_model.networks.checkpoint import Checkpoint, save_checkpoint
from reward_model.networks.registry import NetworkConfig
from reward_model.scenes.ratings import QUESTIONS
from reward_model.scorer import SocialScorer
from reward_model.training.fit import Epoch, TrainingConfig, best_epoch, errors, fit

STATE_FILE: Final = "training_state.safetensors"
CURVE_FILE: Final = "curve.csv"
TENSORBOARD_FOLDER: Final = "tensorboard"


@dataclass(frozen=True)
class Session:
    """The data, network and options of one training.

    Attributes:
        clips_alike: clips have equal weights, however many people scored them; else scores have
    """

    data: DataConfig
    network: NetworkConfig
    training: TrainingConfig
    clips_alike: bool = True


def train(session: Session, output: Path, resume: bool = False) -> dict[str, Any]:
    """Train a network and save it as a checkpoint in `output`, beside its curve and logs.

    Args:
        resume: continue the interrupted training in `output`

    Returns:
        The checkpoint's `about`.

    Raises:
        ValueError: If data or options are not valid.
    """
    usable_device(session.network, session.training.device)
    if not resume and (output / STATE_FILE).exists():
        raise DatasetError(f"{output}: holds a training already; resume it or choose another output")
    with progress_bars(kept=True) as progress:
        parts = load_parts(session.data, progress)
        with _Log(output, epoch_bar(progress, session.training.max_epochs)) as log:
            about = learn(session, parts, output, log, resume)
    for question in sorted(set(QUESTIONS) - set(about["questions"])):
        progress.console.print(
            f"[yellow]nobody was asked for {question.upper()}: this network's {question} means nothing"
        )
    return about


def learn(
    session: Session,
    parts: dict[Part, Examples],
    output: Path,
    after_epoch: Callable[[Epoch], None] = lambda epoch: None,
    resume: bool = False,
) -> dict[str, Any]:
    """Train on parts of a data set, save the checkpoint and return its `about`; see `train`."""
    data = session.data
    windows = {part: examples.labelled() for part, examples in parts.items()}
    windows["train"] = parts["train"].labelled_clips(session.clips_alike)
    trained = learn_windows(session.network, session.training, windows, after_epoch, output / STATE_FILE, resume)
    about = {
        "data": data.path.name,
        "questions": _scored_questions(parts["train"]),
        "examples": {part: len(examples) for part, examples in parts.items()},
        "augmentation": data.augmentation,
        "frames": data.frames,
        "teacher": data.teacher,
        **trained.about,
    }
    save_checkpoint(output, replace(trained, about=about))
    return about


def learn_windows(
    network_config: NetworkConfig,
    config: TrainingConfig,
    parts: Mapping[Part, LabelledWindows],
    after_epoch: Callable[[Epoch], None] = lambda epoch: None,
    state_file: Path | None = None,
    resume: bool = False,
) -> Checkpoint:
    """Train a network on labelled windows; the checkpoint's `about` has the options and the errors.

    Raises as `fit`.

    Args:
        parts: with a train and a development part; a test part adds the errors of its questions that have scores
        after_epoch, state_file, resume: see `fit`
    """
    network = trainable_network(network_config, config.seed)
    history = fit(network, parts["train"], parts["development"], config, after_epoch, state_file, resume)
    best = best_epoch(history)
    about: dict[str, Any] = {
        "training": asdict(config),
        "epochs": len(history),
        "best_epoch": best.number,
        "train_error": best.train_error,
        "development_error": best.development_error,
        "parameters": sum(parameter.numel() for parameter in network.parameters()),
        "range": TrainingRange.of_facts(facts_of(parts["train"].windows)).document(),
    }
    if "test" in parts:
        found = errors(network, parts["test"], config.device).tolist()
        about["test_error"] = {q: e for q, e in zip(QUESTIONS, found, strict=True) if not np.isnan(e)}
    return Checkpoint(network_config, {name: tensor.cpu() for name, tensor in network.state_dict().items()}, about)


def epoch_bar(progress: Progress, max_epochs: int) -> Callable[[Epoch], None]:
    """Add a bar of epochs, and return a function that shows a finished epoch and its errors on it."""
    bar = progress.add_task("train", total=max_epochs)

    def after_epoch(epoch: Epoch) -> None:
        line = f"train, errors {epoch.train_error:.5f} / {epoch.development_error:.5f}"
        progress.update(bar, advance=1, description=line)

    return after_epoch


def evaluate(
    scorer: SocialScorer, data: DataConfig, part: Part | Literal["all"], output: Path | None = None
) -> dict[str, Any]:
    """Compare a network with people's scores.

    Args:
        output: a folder for `evaluation.json` and a histogram of absolute errors for each question

    Returns:
        The report. Raises as `load_part`.
    """
    with progress_bars() as progress:
        examples = load_part(data, part, progress)
        bar = progress.add_task("score", total=len(examples))
        predictions = label_windows(scorer, examples.windows, partial(progress.advance, bar)).scores
    found = {"weights": scorer.name, "data": str(data.path), "part": part, "examples": len(examples)}
    document = found | report(predictions, examples.scores, examples.ratings())
    if output is not None:
        replace_file(output / "evaluation.json", (json.dumps(document, indent=2) + "\n").encode())
        for question in _scored_questions(examples):
            image = error_histogram(predictions, examples.scores, question)
            replace_file(output / f"absolute_errors_{question}.png", image)
    return document


class _Log:
    """Logs every epoch in a CSV file and in TensorBoard, and passes it to `show`."""

    def __init__(self, folder: Path, show: Callable[[Epoch], None]) -> None:
        from torch.utils.tensorboard import SummaryWriter

        self._folder, self._show = folder, show
        self._epochs: list[Epoch] = []
        folder.mkdir(parents=True, exist_ok=True)
        # A resumed training logs its earlier epochs again, so the old log is purged.
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
        self._show(epoch)


def _scored_questions(examples: Examples) -> list[str]:
    return [question for column, question in enumerate(QUESTIONS) if not np.isnan(examples.scores[:, column]).all()]
