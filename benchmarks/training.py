"""Cost of training, the MPNN without its edges against DGL's `NNConv`: `python -m benchmarks.training`.

One thread; windows are simulated and scored by the default network. Both forms start from the same weights, use the
same batches and take turns, so that a machine that slows down slows both down. Before they are timed, their losses and
gradients on one batch are compared. Figures are medians over the runs, with the fastest and the slowest. Then a large
data set is loaded from the cache of graphs.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import torch
from rich.console import Console
from rich.table import Table

from reward_model.base.commands import check_least, run_command
from reward_model.base.files import replace_file
from reward_model.base.progress import watched
from reward_model.data.cache import load_examples, store_examples
from reward_model.data.examples import Examples
from reward_model.data.labelled_windows import LabelledWindows
from reward_model.graph.features import NUM_NODE_FEATURES
from reward_model.graph.frame import FrameGraph
from reward_model.networks.building import network_on_dgl, trainable_network
from reward_model.networks.registry import MPNNConfig
from reward_model.scorer import load_scorer
from socnav_env.simulated_data.windows import generate_windows

SIZES = (NUM_NODE_FEATURES, 40, 30, 20, 2)
EDGE_NETWORKS = ("tabulated", "perceptron")
RATE = 1e-3
QUICK_WINDOWS = 4


@dataclass(frozen=True)
class Training:
    """The extent of the measurement."""

    windows: int = 128
    """Windows of an epoch."""
    batch_size: int = 32
    """Windows of a step."""
    runs: int = 3
    """Epochs of each form."""
    cached: int = 50_000
    """Windows of the data set that is loaded."""
    folder: Path | None = None
    """Temporary folder for that data set, by default the system's."""
    quick: bool = False
    """Little of everything, as a test and not as a measurement."""
    output: Path | None = None
    """A JSON file for the figures."""

    def run(self) -> None:
        """Measure, print and write."""
        check_least(self, windows=1, batch_size=1, runs=1, cached=1)
        torch.set_num_threads(1)
        num_windows = QUICK_WINDOWS if self.quick else self.windows
        windows = generate_windows(num_windows, seed=0)
        data = LabelledWindows(windows, load_scorer("default").score_windows(windows))
        agreements, times = {}, {}
        for edge_network in EDGE_NETWORKS:
            edgeless, on_dgl = Form(edge_network, on_dgl=False), Form(edge_network, on_dgl=True)
            agreements[edge_network] = agreement(edgeless, on_dgl, data, range(min(self.batch_size, len(data))))
            forms = {"without edges": edgeless, "DGL": on_dgl}
            measured = taking_turns(forms, data, self.batch_size, 1 if self.quick else self.runs)
            times |= {(edge_network, name): seconds for name, seconds in measured.items()}
            agreements[f"{edge_network}, after these epochs"] = agreement_when_trained(edgeless, data)
        cache = cache_seconds(windows, 500 if self.quick else self.cached, self.folder)
        for table in (
            epochs_table(times, num_windows, self.batch_size),
            agreement_table(agreements),
            cache_table(cache),
        ):
            Console().print(table)
        if self.output is not None:
            replace_file(self.output, (json.dumps(document(times, agreements, cache), indent=2) + "\n").encode())


@dataclass(frozen=True)
class Agreement:
    """Differences between the form without edges and DGL's on one batch.

    Attributes:
        loss: of DGL's form
        loss_difference: absolute
        gradient_difference: of all gradients as one vector, relative to the vector's length on DGL
    """

    loss: float
    loss_difference: float
    gradient_difference: float


class Form:
    """One form of a network in training."""

    def __init__(self, edge_network: str, on_dgl: bool) -> None:
        self.edge_network = edge_network
        config = MPNNConfig(SIZES, edge_network)
        started = trainable_network(config, seed=0)
        self.network = network_on_dgl(config) if on_dgl else started
        self.network.load_state_dict(started.state_dict())
        torch.nn.init.constant_(self.network.layers[-1].bias, 0.5)
        self.optimizer = torch.optim.AdamW(self.network.parameters(), lr=RATE)

    def loss(self, data: LabelledWindows, rows: range) -> torch.Tensor:
        """The mean squared error of some windows."""
        predictions = self.network.answers([data.windows[row] for row in rows])
        return ((predictions - torch.from_numpy(data.scores[rows.start : rows.stop])) ** 2).mean()

    def gradients(self, data: LabelledWindows, rows: range) -> tuple[float, torch.Tensor]:
        """The loss, and all its gradients as one vector."""
        self.network.train()
        self.optimizer.zero_grad()
        loss = self.loss(data, rows)
        loss.backward()
        return loss.item(), torch.cat([parameter.grad.flatten() for parameter in self.network.parameters()])

    def epoch(self, data: LabelledWindows, batch_size: int) -> float:
        """Seconds of processor time of one pass over all windows."""
        begin = time.process_time()
        for start in range(0, len(data), batch_size):
            self.gradients(data, range(start, min(start + batch_size, len(data))))
            self.optimizer.step()
        return time.process_time() - begin


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    return run_command("python -m benchmarks.training", Training, arguments, __doc__)


def agreement(edgeless: Form, on_dgl: Form, data: LabelledWindows, rows: range) -> Agreement:
    """Compare both forms' losses and gradients with the same weights on the same windows."""
    loss, gradients = edgeless.gradients(data, rows)
    expected_loss, expected = on_dgl.gradients(data, rows)
    difference = float((gradients - expected).norm() / expected.norm())
    return Agreement(expected_loss, abs(loss - expected_loss), difference)


def agreement_when_trained(edgeless: Form, data: LabelledWindows) -> Agreement:
    """The same for the trained network, whose weights are copied to DGL's form."""
    on_dgl = Form(edgeless.edge_network, on_dgl=True)
    on_dgl.network.load_state_dict(edgeless.network.state_dict())
    return agreement(edgeless, on_dgl, data, range(min(16, len(data))))


def taking_turns(forms: dict[str, Form], data: LabelledWindows, batch_size: int, runs: int) -> dict[str, list[float]]:
    """Seconds of every form's epochs, trained in turns."""
    seconds: dict[str, list[float]] = {name: [] for name in forms}
    for _ in watched(range(runs), "training"):
        for name, form in forms.items():
            seconds[name].append(form.epoch(data, batch_size))
    return seconds


def cache_seconds(windows: list[list[FrameGraph]], count: int, folder: Path | None) -> dict[str, Any]:
    """Seconds to store and load a data set of `count` windows, and then to look up every one of them."""
    names = tuple(map(str, range(count)))
    # Frames shared by windows are stored once: each window has frames of its own here.
    repeated = [[FrameGraph.of_words(frame.words) for frame in windows[index % len(windows)]] for index in range(count)]
    scores = np.zeros((count, 2), dtype=np.float32)
    examples = Examples(repeated, scores, names, names, ("",) * count, np.zeros(count, dtype=np.int64))
    with tempfile.TemporaryDirectory(dir=folder) as place:
        entry = Path(place) / "entry"
        stored = seconds_of(lambda: store_examples(examples, entry))
        size = sum(path.stat().st_size for path in entry.iterdir())
        loaded: list[Examples] = []
        load = seconds_of(lambda: loaded.append(load_examples(entry)))
        look_up = seconds_of(lambda: [len(window) for window in loaded[0].windows])
        loaded.clear()
    return {"windows": count, "bytes": size, "store": stored, "load": load, "look up all": look_up}


def seconds_of(work: Callable[[], object]) -> float:
    """Seconds of processor time of a call."""
    begin = time.process_time()
    work()
    return time.process_time() - begin


def document(
    times: dict[tuple[str, str], list[float]], agreements: dict[str, Agreement], cache: dict[str, Any]
) -> dict[str, Any]:
    """All figures as a JSON document."""
    return {
        "seconds": [{"edge_network": edges, "form": form, "epochs": each} for (edges, form), each in times.items()],
        "agreement": {name: asdict(each) for name, each in agreements.items()},
        "cache": cache,
    }


def epochs_table(times: dict[tuple[str, str], list[float]], num_windows: int, batch_size: int) -> Table:
    """Median, fastest and slowest epoch of every form."""
    table = Table(title=f"Seconds an epoch of {num_windows} windows, batches of {batch_size}, one thread")
    for heading in ("edge network", "form", "median", "fastest", "slowest", "times without edges"):
        table.add_column(heading, justify="left" if heading in ("edge network", "form") else "right")
    for (edge_network, form), seconds in times.items():
        ratio = median(seconds) / median(times[edge_network, "without edges"])
        figures = [f"{value:.2f}" for value in (median(seconds), min(seconds), max(seconds))]
        table.add_row(edge_network, form, *figures, f"{ratio:.1f} x")
    return table


def agreement_table(agreements: dict[str, Agreement]) -> Table:
    """The differences between the forms."""
    table = Table("edge network", "loss", "loss off by", "gradient off by", title="One batch in both forms")
    for name, found in agreements.items():
        table.add_row(name, f"{found.loss:.5f}", f"{found.loss_difference:.1e}", f"{found.gradient_difference:.1e}")
    return table


def cache_table(cache: dict[str, Any]) -> Table:
    """Seconds of each operation of the cache."""
    table = Table("", "seconds", title=f"{cache['windows']:,} windows in the cache, {cache['bytes'] / 1e6:,.0f} MB")
    for name in ("store", "load", "look up all"):
        table.add_row(name, f"{cache[name]:.1f}")
    return table


if __name__ == "__main__":
    sys.exit(main())
