"""`search`, `experiments` and `label` of `python -m reward_model`; what they do is imported when they run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from reward_model.base.commands import check_least
from reward_model.base.progress import progress_bars
from reward_model.commands.learning import graph_folder
from reward_model.studies.search_space import SearchSpace


@dataclass(frozen=True)
class Search:
    """Random search for the best of several networks, by default the three and the ranges of Bachiller et al. 2021.

    An Optuna study (study.db) with a folder a session, and the results as Markdown, CSV and JSON. Ranges are drawn from
    evenly, both ends included; sessions take the networks in turn. What a session draws follows from the seed and its
    number alone. After any interruption --resume takes up the sessions that were running where they were; with more
    --sessions it adds to a search that is over.
    """

    data: Path
    """A .jsonl file of SocNav1 ratings, a .txt list of SocNav2 recordings, or a folder (docs/datasets.md)."""
    output: Path
    """The folder of the study."""
    space: Annotated[SearchSpace, tyro.conf.arg(name="")]
    sessions: int = 341
    """Trainings in all."""
    jobs: int = 1
    """Sessions at a time, each on one thread."""
    backend: Literal["loky", "ray"] = "loky"
    """Of joblib: processes here, or a Ray cluster that sees this folder (pip install "socnav2[ray]")."""
    seed: int = 0
    """Of what is drawn."""
    augment: Literal["none", "mirror", "all", "moments"] = "mirror"
    """As for train."""
    weigh: Literal["clips", "ratings"] = "clips"
    """As for train."""
    held_out: float = 0.1
    """As for train."""
    split_seed: int = 0
    """As for train."""
    test: Path | None = None
    """As for train."""
    teacher: str | None = None
    """As for train."""
    frames: Literal[1, 2, 3] = 3
    """As for train."""
    cache: bool = True
    """As for train."""
    device: str = "cpu"
    """cpu or cuda."""
    resume: bool = False
    """Go on with the search in the output folder."""

    def run(self) -> None:
        """Search and print the table of the best."""
        try:
            from reward_model.studies.search import SearchConfig, search
        except ImportError as error:
            raise ValueError(f"a search needs Optuna, install it with pip install optuna ({error})") from None
        from reward_model.data.loading import DataConfig
        from reward_model.studies.search_report import best_of_blocks, markdown

        config = SearchConfig(self.sessions, self.seed, self.weigh == "clips", self.jobs, self.backend, self.device)
        cache = graph_folder(self.cache)
        data = DataConfig(
            self.data, self.augment, self.held_out, self.split_seed, cache, self.frames, self.test, self.teacher
        )
        rows = search(data, self.space, config, self.output, self.resume)
        print(markdown(best_of_blocks(rows)), end="", flush=True)


@dataclass(frozen=True)
class Experiments:
    """Train R-GCN, GAT and MPNN on the same data with several seeds, and print one table of their errors.

    In the output folder are the table as Markdown and JSON, a checkpoint a training, and histograms of absolute errors
    on the test part. After any interruption --resume goes on; with more --seeds it adds to an experiment that is over.
    """

    data: Path
    """As for train."""
    output: Path
    """A folder for everything."""
    kind: Literal["static", "sequences", "simulated"]
    """static: still scenes, as SocNav1's; sequences: recordings in which things move, with the paper's augmentation;
    simulated: recordings that a teacher has labelled, of which it scores earlier moments, too."""
    test: Path | None = None
    """As for train."""
    teacher: str | None = None
    """As for train."""
    seeds: tuple[int, ...] = (0, 1, 2)
    """Of first weights and the order of the data."""
    jobs: int = 1
    """Trainings at a time, each on one thread."""
    max_epochs: int | None = None
    """Instead of the settings' own, for a trial."""
    cache: bool = True
    """As for train."""
    resume: bool = False
    """Go on with the experiment in the output folder."""

    def run(self) -> None:
        """Train what is still to be trained, and print the table."""
        from reward_model.data.loading import DataConfig
        from reward_model.studies.experiments import RECIPES, experiment

        recipe = RECIPES[self.kind]
        cache = graph_folder(self.cache)
        data = DataConfig(
            self.data, recipe.augmentation, recipe.held_out, 0, cache, recipe.frames, self.test, self.teacher
        )
        table = experiment(data, self.kind, self.output, self.seeds, self.jobs, self.resume, self.max_epochs)
        print(table, end="", flush=True)


@dataclass(frozen=True)
class Label:
    """Write recordings anew with a network's scores in them, so that other networks can learn its answers.

    Such labels are no people's scores. After any interruption the same command does what is missing.
    """

    data: Path
    """A SocNav2 recording, a .txt list of them or a folder."""
    output: Path
    """The folder of the labelled copies, which keep their names."""
    weights: str = "published"
    """default (what ships), published (after import-published) or a checkpoint folder."""
    jobs: int = 1
    """Processes that share the work."""

    def run(self) -> None:
        """Label, and print where the copies are."""
        from reward_model.data.labelling import label_files, unlabelled_files

        check_least(self, jobs=1)
        files = unlabelled_files(self.data, self.output)
        with progress_bars() as progress:
            bar = progress.add_task("label", total=len(files))
            for count in label_files(files, self.output, self.weights, self.jobs):
                progress.advance(bar, count)
        print(self.output)
