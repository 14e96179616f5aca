"""Milliseconds to score one window, by network and by form: `python -m benchmarks.scoring`.

Windows of genuine recordings on one thread, and batches on `--threads` as well; the forms take turns, so that a
machine that slows down slows all of them down. Figures are medians over the runs, with the fastest and the slowest.
Making the graphs is timed by itself.

Where DGL is installed, the two forms' scores are compared as well, on the windows of all recordings at every moment
and on generated ones: the largest difference, and the 99th percentile.
"""

from __future__ import annotations

import json
import os
import sys
import time
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np
import torch
from rich.console import Console
from rich.table import Table

from reward_model.base.arrays import Float32Array
from reward_model.base.commands import check_least, run_command
from reward_model.base.files import replace_file
from reward_model.base.progress import watched
from reward_model.fast.from_checkpoint import tensor_shapes
from reward_model.graph.frame import FrameGraph
from reward_model.graph.windows import frame_graph, sequence_frames, wall_segments
from reward_model.networks.building import trainable_network
from reward_model.networks.checkpoint import Checkpoint, CheckpointError
from reward_model.networks.registry import MPNNConfig, NetworkConfig
from reward_model.published import SIZES, STATE_FILE
from reward_model.scenes.scene import SceneSequence
from reward_model.scenes.socnav2_json import read_socnav2
from reward_model.scorer import Form, SocialScorer, load_scorer, weights_path
from reward_model.studies.experiments import RECIPES
from socnav_env.simulated_data.sequences import simulate_sequence
from socnav_env.simulated_data.windows import generate_windows

BATCH = 64
NUM_SIMULATED = 6  # as many as there are genuine ones
DATA = Path(os.environ.get("SOCNAV_DATA") or Path(__file__).parents[2] / "shared" / "data")

ALONE = "compiled, one by one"  # the reference of the others
AS_PUBLISHED = "DGL, as published"

UNTRAINED = {
    name: RECIPES["simulated"].settings[kind].network
    for name, kind in (("MPNN", "mpnn"), ("R-GCN", "rgcn"), ("GAT", "gat"))
}

Windows = list[list[FrameGraph]]
Score = Callable[[Windows], Float32Array]
Load = Callable[[Form], SocialScorer]


class Row(NamedTuple):
    """One row of the table: `score` is called with `num_windows` windows at a time, with `num_timed` in all."""

    network: str
    name: str
    score: Callable[[Windows], object]
    num_windows: int
    num_timed: int


@dataclass(frozen=True)
class Scoring:
    """The data and the extent of the measurement."""

    data: Path = DATA
    """Folder with `socnav2_samples`; SOCNAV_DATA sets another default."""
    wheel: Path | None = None
    """Wheel of socnavgym 0.1.1, to measure its network with its denormal numbers as well (a second a window on
    processors that are slow with those)."""
    runs: int = 15
    """Runs of each form."""
    threads: int = 2
    """Threads for batches, measured beside one thread."""
    generated: int = 1000
    """Generated windows for the comparison of forms, beside those of the recordings."""
    quick: bool = False
    """One run, as a test and not as a measurement."""
    output: Path | None = None
    """A JSON file for the figures."""

    def run(self) -> None:
        """Measure, print and write."""
        check_least(self, runs=1, threads=1)
        torch.set_num_threads(1)
        console = Console()
        sequences = recordings(self.data, console)
        windows = genuine_windows(sequences)
        networks = networks_here(console)
        forms = [graph_making(sequences)]
        for name, load in networks.items():
            forms += network_forms(name, load, self.threads)
        if self.wheel is not None:
            forms.append(Row("published", AS_PUBLISHED, published_as_it_is(self.wheel).score_windows, 1, 2))
        runs = 1 if self.quick else self.runs
        times = taking_turns(forms, windows, runs)
        console.print(_table(times, runs))
        compared = windows[:2] if self.quick else every_window(sequences)
        compared += generate_windows(2 if self.quick else self.generated, seed=0)
        apart = {
            name: differences(name, load, on_dgl, compared)
            for name, load in networks.items()
            if (on_dgl := loaded_on_dgl(load)) is not None
        }
        for name, (largest, nearly) in apart.items():
            console.print(f"{name}: {largest:.1e} from DGL at most, 99 % of {len(compared)} windows below {nearly:.1e}")
        if self.output is not None:
            rows = [{"network": network, "form": form, "ms": each} for (network, form), each in times.items()]
            document = {"times": rows, "differences": apart}
            replace_file(self.output, (json.dumps(document, indent=2) + "\n").encode())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    return run_command("python -m benchmarks.scoring", Scoring, arguments, __doc__)


def taking_turns(forms: list[Row], windows: Windows, runs: int) -> dict[tuple[str, str], list[float]]:
    """Milliseconds a window of every form in every run, after one run that is not timed."""
    times: dict[tuple[str, str], list[float]] = {(form.network, form.name): [] for form in forms}
    for form in forms:
        milliseconds(form, windows[: form.num_windows])
    for _ in watched(range(runs), "measuring"):
        for form in forms:
            times[form.network, form.name].append(milliseconds(form, windows[: form.num_timed]))
    return times


def recordings(data: Path, console: Console) -> list[SceneSequence]:
    """The genuine recordings, or simulated ones where the default folder has none."""
    sequences = [read_socnav2(file) for file in sorted((data / "socnav2_samples").glob("S*.json"))]
    if not sequences and data != DATA:
        raise ValueError(f"{data}: must hold recordings in socnav2_samples; --data names another folder")
    if not sequences:
        console.print(f"no recordings in {data / 'socnav2_samples'}: simulated ones take their place")
        sequences = [simulate_sequence(0, index) for index in range(NUM_SIMULATED)]
    return sequences


def genuine_windows(sequences: list[SceneSequence]) -> Windows:
    """A batch of windows: the last second of each recording, then of each without its newest snapshots."""
    windows: Windows = []
    left_out = 0
    while len(windows) < BATCH:
        for sequence in sequences:
            windows.append(
                sequence_frames(SceneSequence(sequence.snapshots[: len(sequence) - left_out], sequence.name))
            )
        left_out += 1
    return windows[:BATCH]


def graph_making(sequences: list[SceneSequence]) -> Row:
    """The row for making a window's newest frame; its older ones exist already."""
    newest = [sequence.last for sequence in sequences]
    segments = [wall_segments(snapshot.walls) for snapshot in newest]

    def make(windows: Windows) -> None:
        for index in range(len(windows)):
            frame_graph(newest[index % len(newest)], segments[index % len(newest)])

    return Row("any", "one frame's graph", make, BATCH, BATCH)


def networks_here(console: Console) -> dict[str, Load]:
    """The loaders of networks: those with weights on this machine, and the paper's three, small and untrained."""
    networks: dict[str, Load] = {"default": partial(load_scorer, "default")}
    try:
        weights_path("published")
        networks["published"] = partial(load_scorer, "published")
    except CheckpointError as error:
        console.print(f"without the published network: {error}")
    return networks | {name: partial(untrained, config) for name, config in UNTRAINED.items()}


def untrained(config: NetworkConfig, form: Form) -> SocialScorer:
    """A network with random weights, which take as long as trained ones."""
    if isinstance(config, MPNNConfig):
        return SocialScorer(Checkpoint(config, trainable_network(config, 0).state_dict()), "untrained", form)
    generator = torch.Generator().manual_seed(0)
    tensors = {
        name: torch.randn(shape, generator=generator) / shape[-1] ** 0.5 / 2
        for name, shape in tensor_shapes(config).items()
    }
    last = f"layers.{len(config.sizes) - 2}."
    for name in (each for each in tensors if each.startswith(last) and "bias" in each):
        tensors[name] += 1  # or many scores would be 0
    return SocialScorer(Checkpoint(config, tensors), "untrained", form)


def network_forms(network: str, load: Load, threads: int) -> list[Row]:
    """The rows of a network's forms; DGL's where it is installed."""
    compiled = load("compiled").score_windows
    forms = [
        Row(network, ALONE, compiled, 1, BATCH),
        Row(network, f"compiled, {BATCH} at once", compiled, BATCH, BATCH),
    ]
    if threads > 1:
        forms.append(Row(network, f"the same, {threads} threads", on_threads(compiled, threads), BATCH, BATCH))
    if (on_dgl := loaded_on_dgl(load)) is not None:
        forms.append(Row(network, "DGL, denormals flushed", on_dgl, 1, 6))
    return forms


def loaded_on_dgl(load: Load) -> Score | None:
    """A network on DGL with denormals flushed, or None where DGL is not installed."""
    try:
        return flushing_denormals(load("dgl").score_windows)
    except CheckpointError:
        return None


def every_window(sequences: list[SceneSequence]) -> Windows:
    """The windows of each recording at each of its snapshots, as if it ended there."""
    return [
        sequence_frames(SceneSequence(sequence.snapshots[:length], sequence.name))
        for sequence in sequences
        for length in range(1, len(sequence) + 1)
    ]


def differences(network: str, load: Load, on_dgl: Score, windows: Windows) -> tuple[float, float]:
    """The largest difference between a network's two forms, and the 99th percentile over windows."""
    compiled = load("compiled").score_windows(windows)
    places = watched(range(len(windows)), f"comparing {network}")
    expected = np.concatenate([on_dgl([windows[place]]) for place in places])
    apart = np.abs(compiled - expected).max(axis=1)
    return float(apart.max()), float(np.percentile(apart, 99))


def published_as_it_is(wheel: Path) -> SocialScorer:
    """The published network on DGL with every number of its file, denormal ones too."""
    with zipfile.ZipFile(wheel) as archive, archive.open(STATE_FILE) as file:
        state = torch.load(file, map_location="cpu", weights_only=True)
    last = len(SIZES) - 2
    prefixes = {f"gnn_object.layers.{index}.": f"layers.{index + 1}." for index in range(last - 1)}
    prefixes |= {"gnn_object.NNconv_input.": "layers.0.", "gnn_object.NNConv_output.": f"layers.{last}."}
    tensors = {
        ours + name.removeprefix(theirs): tensor
        for theirs, ours in prefixes.items()
        for name, tensor in state.items()
        if name.startswith(theirs)
    }
    return SocialScorer(Checkpoint(MPNNConfig(SIZES, "perceptron"), tensors), "as published", "dgl")


def on_threads(score: Score, threads: int) -> Score:
    """The same function, run on a number of threads."""

    def threaded(windows: Windows) -> Float32Array:
        torch.set_num_threads(threads)
        try:
            return score(windows)
        finally:
            torch.set_num_threads(1)

    return threaded


def flushing_denormals(score: Score) -> Score:
    """The same function, with denormal numbers taken as zero in this thread, as if they were not in the weights."""

    def flushed(windows: Windows) -> Float32Array:
        torch.set_flush_denormal(True)
        try:
            return score(windows)
        finally:
            torch.set_flush_denormal(False)

    return flushed


def milliseconds(form: Row, windows: Windows) -> float:
    """Milliseconds a window, averaged over all windows."""
    begin = time.perf_counter()
    for start in range(0, len(windows), form.num_windows):
        form.score(windows[start : start + form.num_windows])
    return 1000 * (time.perf_counter() - begin) / len(windows)


def _table(times: dict[tuple[str, str], list[float]], runs: int) -> Table:
    table = Table(title=f"Milliseconds a window, {runs} runs")
    for heading in ("network", "form", "median", "fastest", "slowest", "times the compiled"):
        table.add_column(heading, justify="left" if heading in ("network", "form") else "right")
    for (network, form), values in times.items():
        figures = [f"{value:.3f}" for value in (median(values), min(values), max(values))]
        single = times.get((network, ALONE))
        ratio = f"{median(values) / median(single):.2f} x" if single else ""
        table.add_row(network, form, *figures, ratio)
    return table


if __name__ == "__main__":
    sys.exit(main())
