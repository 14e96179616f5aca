"""`train`, `evaluate` and `agreement` of `python -m reward_model`; what they do is imported when they run."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

import tyro

from reward_model.networks.option_fields import with_options
from reward_model.networks.registry import NETWORKS, Kind, NetworkConfig, network_config

if TYPE_CHECKING:
    from reward_model.base.arrays import FloatArray

GRAPHS: Final = "graphs"  # the folder of the user's cache that keeps them
_NETWORKS_HELP: Final = f"What it sees of edges: {'; '.join(f'{kind} {each.sees}' for kind, each in NETWORKS.items())}."


@dataclass(frozen=True)
@with_options
class Train:
    """Train a network on people's scores: a checkpoint folder, its curve as CSV and for TensorBoard.

    An interrupted training goes on with --resume as if nothing had happened.
    """

    data: Path
    """A .jsonl file of SocNav1 ratings, a .txt list of SocNav2 recordings, or a folder (docs/datasets.md)."""
    output: Path
    """The checkpoint folder."""
    network: Annotated[Kind, tyro.conf.arg(help=_NETWORKS_HELP)] = "mpnn"
    hidden_sizes: tuple[int, ...] = (40, 30, 20)
    """Features of the hidden layers, for gat of each head."""
    max_epochs: int = 60
    patience: int = 8
    """Epochs without a better development error before training stops."""
    batch_size: int = 64
    learning_rate: float = 2e-3
    weight_decay: float = 1e-6
    seed: int = 0
    """Of the first weights and the order of the data."""
    augment: Literal["none", "mirror", "all", "moments"] = "mirror"
    """Copies of the training scenes: mirrored; or also with the robot turned round, for scenes in which it drives; or
    earlier moments, which a teacher scores."""
    weigh: Literal["clips", "ratings"] = "clips"
    """What counts the same: every clip, however many people scored it, or every rating."""
    held_out: float = 0.1
    """Share of scenes for development, and for the test, where the data is not split."""
    split_seed: int = 0
    """Which scenes these are."""
    teacher: str | None = None
    """Weights of the network that labelled the data, if one did: it then scores augmented copies, too."""
    test: Path | None = None
    """Other data to report errors on; where the first is not split, none of it is then kept for the test."""
    frames: Literal[1, 2, 3] = 3
    """Of each window, the newest; 1 is enough where nothing moves, as in SocNav1, and takes a third of the time."""
    cache: bool = True
    """Keep the graphs made of the data in the user's cache folder, or SOCNAV_CACHE, for the next time."""
    device: str = "auto"
    """cpu, cuda, or auto: cuda where PyTorch and the network can use it."""
    resume: bool = False
    """Go on with the training in the output folder."""

    def run(self) -> None:
        """Train and print what the checkpoint says about itself, as JSON."""
        from reward_model.data.loading import DataConfig
        from reward_model.networks.building import best_device
        from reward_model.training.fit import TrainingConfig
        from reward_model.training.session import Session, train

        network = self._network()
        device = best_device(network) if self.device == "auto" else self.device
        config = TrainingConfig(
            self.max_epochs, self.patience, self.batch_size, self.learning_rate, self.weight_decay, self.seed, device
        )
        data = DataConfig(
            self.data,
            self.augment,
            self.held_out,
            self.split_seed,
            graph_folder(self.cache),
            self.frames,
            self.test,
            self.teacher,
        )
        about = train(Session(data, network, config, self.weigh == "clips"), self.output, self.resume)
        print(json.dumps(about, indent=2), flush=True)

    def _network(self) -> NetworkConfig:
        from reward_model.graph.features import NUM_NODE_FEATURES

        options = {name: getattr(self, name) for name in NETWORKS[self.network].config.option_fields()}
        return network_config(self.network, (NUM_NODE_FEATURES, *self.hidden_sizes, 2), options)


@dataclass(frozen=True)
class Evaluate:
    """Compare a network with people's scores: errors, rank correlation and the human ceiling, as JSON.

    A network sees as many frames of each window as it was trained on.
    """

    data: Path
    """As for train."""
    weights: str = "default"
    """default (what ships), published (after import-published) or a checkpoint folder."""
    part: Literal["all", "train", "development", "test"] = "all"
    """Which scenes; data that is not split is split as train does it."""
    held_out: float = 0.1
    """As for train."""
    split_seed: int = 0
    """As for train."""
    cache: bool = True
    """As for train."""
    output: Path | None = None
    """A folder for the JSON and a histogram of absolute errors a question."""

    def run(self) -> None:
        """Evaluate and print the report."""
        from reward_model.data.loading import DataConfig
        from reward_model.graph.features import NUM_FRAMES
        from reward_model.networks.checkpoint import load_checkpoint
        from reward_model.scorer import load_scorer, weights_path
        from reward_model.training.session import evaluate

        scorer = load_scorer(self.weights)
        frames = load_checkpoint(weights_path(self.weights)).about.get("frames", NUM_FRAMES)
        cache = graph_folder(self.cache)
        data = DataConfig(self.data, "none", self.held_out, self.split_seed, cache, frames)
        document = evaluate(scorer, data, self.part, self.output)
        print(json.dumps(document, indent=2), flush=True)


@dataclass(frozen=True)
class Agreement:
    """How far people agree: linearly weighted kappa between raters and with themselves, and the human ceiling."""

    ratings: Annotated[tyro.conf.Positional[tuple[Path, ...]], tyro.conf.arg(metavar="FILE...", help_behavior_hint="")]
    """Tables (.csv: clip, rater, q1, q2) or SocNav1 ratings (.jsonl), all taken together."""

    def run(self) -> None:
        """Print the matrices as JSON, None where two raters have no clip in common."""
        if not self.ratings:
            raise ValueError("agreement needs at least one file")
        from reward_model.analysis.agreement import agreement
        from reward_model.analysis.evaluation import human_ceiling
        from reward_model.scenes.ratings import QUESTIONS, read_ratings

        ratings = read_ratings(self.ratings)
        document: dict[str, object] = {}
        for column, question in enumerate(QUESTIONS):
            if ratings.of_question(column):
                found = agreement(ratings, column)
                ceiling = asdict(human_ceiling(ratings, column))
                document[question] = {
                    "raters": found.raters,
                    "kappa": _rows(found.kappa),
                    "counts": found.counts.tolist(),
                    "ceiling": {name: None if math.isnan(value) else value for name, value in ceiling.items()},
                }
        print(json.dumps(document), flush=True)


def graph_folder(cache: bool) -> Path | None:
    """Where graphs are kept for the next time, if they are."""
    from reward_model.scorer import cache_folder

    return cache_folder() / GRAPHS if cache else None


def _rows(matrix: FloatArray) -> list[list[float | None]]:
    return [[None if math.isnan(value) else round(value, 4) for value in row] for row in matrix.tolist()]
