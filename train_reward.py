"""Train the default reward network: `python train_reward.py`.

Simulated scenes under good and bad drivers are scored by the published network (Bachiller et al. 2021; import it
first with `python -m reward_model import-published socnavgym==0.1.1`), and a small MPNN of our own learns those
answers. The result is a checkpoint folder with a model card that says how far the two are apart.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import torch
import tyro
from rich.console import Console
from rich.progress import Progress, TaskID

from reward_model.base.files import replace_file
from reward_model.data.labelled_windows import LabelledWindows
from reward_model.graph.features import NUM_NODE_FEATURES
from reward_model.graph.frame import FrameGraph
from reward_model.graph.windows import mirrored_frame
from reward_model.networks.checkpoint import Checkpoint, CheckpointError, save_checkpoint
from reward_model.networks.factorised_mpnn import EdgelessMPNN
from reward_model.networks.registry import MPNNConfig
from reward_model.scenes.scene import ScenarioError, SceneSequence
from reward_model.scenes.socnav2_json import read_socnav2
from reward_model.scorer import SocialScorer, load_scorer
from reward_model.training.fit import Epoch, TrainingConfig, errors, fit
from socnav_env.simulated_data.windows import generate_windows

DEFAULT_OUTPUT = Path(__file__).parent / "reward_model" / "weights" / "default"
_DROPPED = 3  # snapshots cut off a genuine sequence's end for a second row, as the published reference does
_LABELLING_CHUNK = 500  # windows between two moves of the progress bar


@dataclass(frozen=True)
class Options:
    """What to train on, and where the result goes.

    num_windows: simulated windows to train on; as many again, mirrored, are labelled and trained on too
    num_held_out: windows for stopping early, and as many for the test, from episodes of their own
    hidden_sizes: features of the hidden layers
    seed: of scenes and training
    jobs: processes that simulate
    output: the checkpoint folder, replaced when training has finished
    genuine: a folder of SocNav2 recordings, to compare the two networks on as well
    """

    num_windows: int = 260_000
    num_held_out: int = 3_000
    hidden_sizes: tuple[int, ...] = (40, 28, 20)
    max_epochs: int = 6
    patience: int = 3
    batch_size: int = 64
    learning_rate: float = 1e-2
    seed: int = 67
    jobs: int = 2
    output: Path = DEFAULT_OUTPUT
    genuine: Path | None = None

    def __post_init__(self) -> None:
        for name in ("num_windows", "num_held_out", "jobs"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, got {getattr(self, name)}")


def main() -> None:
    """Read the command line, train, and end with one clear line where something is missing."""
    try:
        train(tyro.cli(Options, description=__doc__))
    except (CheckpointError, ScenarioError, ValueError, OSError) as error:
        print(f"train_reward.py: {error}", file=sys.stderr)
        sys.exit(2)


def train(options: Options) -> None:
    """Simulate, label, train, report, save."""
    console = Console(stderr=True)
    config = TrainingConfig(
        options.max_epochs, options.patience, options.batch_size, options.learning_rate, seed=options.seed
    )
    teacher = load_scorer("published")
    genuine = _genuine(options.genuine)
    with Progress(console=console) as progress:
        sizes = (options.num_windows, options.num_held_out, options.num_held_out)
        parts = []
        for name, size, part in zip(("train", "development", "test"), sizes, range(3), strict=True):
            parts.append(_labelled(teacher, progress, name, size, 3 * options.seed + part, options.jobs))
        torch.manual_seed(options.seed)
        network_config = MPNNConfig((NUM_NODE_FEATURES, *options.hidden_sizes, 2), "tabulated")
        network = EdgelessMPNN(network_config.sizes, network_config.edge_network)
        history = _fit(network, parts[0], parts[1], config, progress)
    report = {
        "windows": dict(zip(("train", "development", "test"), sizes, strict=True)),
        "training": asdict(config),
        "epochs": len(history),
        "development_error": min(epoch.development_error for epoch in history),
        "test_error": dict(zip(("q1", "q2"), map(float, errors(network, parts[2])), strict=True)),
        "parameters": sum(parameter.numel() for parameter in network.parameters()),
    }
    checkpoint = Checkpoint(network_config, network.state_dict(), {"teacher": "published", **report})
    if genuine:
        report["genuine_error"] = _genuine_errors(teacher, SocialScorer(checkpoint, "trained"), genuine)
        checkpoint = replace(checkpoint, about={"teacher": "published", **report})
    save_checkpoint(options.output, checkpoint)
    replace_file(options.output / "README.md", _model_card(checkpoint).encode())
    console.print_json(data=report)


class _WithMirrored(Sequence[list[FrameGraph]]):
    """Windows, followed by their mirror images with walls as recorders list them, made when they are asked for."""

    def __init__(self, windows: list[list[FrameGraph]]) -> None:
        self._windows = windows

    def __len__(self) -> int:
        return 2 * len(self._windows)

    def __getitem__(self, index):
        if isinstance(index, slice):
            return [self[each] for each in range(len(self))[index]]
        if index < len(self._windows):
            return self._windows[index]
        return [mirrored_frame(frame, turn_walls=True) for frame in self._windows[index - len(self._windows)]]


def _labelled(teacher: SocialScorer, progress: Progress, name: str, size: int, seed: int, jobs: int) -> LabelledWindows:
    bar = progress.add_task(f"simulate {name}", total=None)
    windows = generate_windows(size, seed, jobs)
    return _scored(teacher, progress, bar, name, _WithMirrored(windows) if name == "train" else windows)


def _scored(
    teacher: SocialScorer, progress: Progress, bar: TaskID, name: str, windows: Sequence[list[FrameGraph]]
) -> LabelledWindows:
    progress.update(bar, description=f"label {name}", total=len(windows))
    scores = []
    for start in range(0, len(windows), _LABELLING_CHUNK):
        scores.append(teacher.score_windows(windows[start : start + _LABELLING_CHUNK]))
        progress.advance(bar, len(scores[-1]))
    return LabelledWindows(windows, np.concatenate(scores))


def _fit(
    network: EdgelessMPNN,
    train_windows: LabelledWindows,
    development: LabelledWindows,
    config: TrainingConfig,
    progress: Progress,
) -> list[Epoch]:
    bar = progress.add_task("train", total=config.max_epochs)

    def after_epoch(epoch: Epoch) -> None:
        line = f"train, errors {epoch.train_error:.5f} / {epoch.development_error:.5f}"
        progress.update(bar, advance=1, description=line)

    return fit(network, train_windows, development, config, after_epoch)


def _genuine(folder: Path | None) -> list[SceneSequence]:
    """Every recording of the folder, whole and without its last snapshots."""
    if folder is None:
        return []
    paths = sorted(path for path in folder.glob("*.json") if path.name != "reference.json")
    if not paths:
        raise ScenarioError(f"{folder}: must hold SocNav2 recordings (*.json), found none")
    whole = [read_socnav2(path) for path in paths]
    return [*whole, *(SceneSequence(each.snapshots[:-_DROPPED], each.name) for each in whole)]


def _genuine_errors(teacher: SocialScorer, student: SocialScorer, sequences: list[SceneSequence]) -> dict[str, float]:
    differences = np.abs(student.score_batch(sequences) - teacher.score_batch(sequences))
    q1, q2 = differences.mean(axis=0)
    return {"rows": len(sequences), "q1_mae": float(q1), "q2_mae": float(q2), "worst": float(differences.max())}


def _model_card(checkpoint: Checkpoint) -> str:
    about, sizes = checkpoint.about, "-".join(map(str, checkpoint.config.sizes))
    genuine = about.get("genuine_error")
    genuine_row = (
        f"| {genuine['rows']} rows of genuine SocNav2 recordings, mean absolute error "
        f"| {genuine['q1_mae']:.4f} | {genuine['q2_mae']:.4f} |\n"
        if genuine
        else ""
    )
    windows = about["windows"]
    return f"""# The default reward network

An MPNN of {sizes} features with {about["parameters"]:,} parameters. It gives Q1 and Q2, 0 to 1, for the last
second of a scene (three frames, one second apart).

**What it learned from.** The answers of the published network (Bachiller et al. 2021) to {windows["train"]:,}
windows of *simulated* scenes and to as many mirror images: people walk by social force, and the robot is driven well
and badly. It is not trained on SocNav2's human scores, and its answers are not human scores: it inherits the published
network's errors and adds its own.

**How.** Mean squared error, AdamW with a cosine schedule, early stopping on {windows["development"]:,} windows of
other episodes; {about["epochs"]} epochs, seed {about["training"]["seed"]}. `python train_reward.py` repeats it.

**How close it is to its teacher.**

| compared on | Q1 | Q2 |
|---|---|---|
| {windows["test"]:,} windows of held-out simulated episodes, mean squared error | {about["test_error"]["q1"]:.5f} \
| {about["test_error"]["q2"]:.5f} |
{genuine_row}
**Where not to trust it.** Rooms larger than 12 m, robots faster than 0.37 m/s, more than about 18 people: nothing
of the kind was in its training. For numbers to compare with the literature use the published network.
"""


if __name__ == "__main__":
    main()
