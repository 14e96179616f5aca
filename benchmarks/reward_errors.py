"""Errors of networks against the symmetrised teacher: `python -m benchmarks.reward_errors`.

Windows of simulated episodes over the whole range of the simulator, and with `--agents` of the states that agents
visit, are scored by the published network in four images; the mean of the four is what a network should answer. Errors
are told apart by the range in which the four agree, the teacher's sane one. A network is asked once, and with
`--images` also with the mean over the window and its mirror image. Spearman's rank correlation, and the picture that
`--plot` draws, say whether an ensemble's deviation goes with its error.
"""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from agents.visited import AgentEpisode
from reward_model.analysis.evaluation import rank_correlation
from reward_model.base.arrays import Float32Array
from reward_model.base.commands import check_least, run_command
from reward_model.base.files import replace_file
from reward_model.base.progress import watched
from reward_model.data.labelling import image_scores
from reward_model.data.taught import TaughtWindows
from reward_model.graph.star import Stars
from reward_model.graph.windows import mirrored_frame
from reward_model.scenes.ratings import QUESTIONS
from reward_model.scorer import Assessment, SocialScorer, load_scorer
from socnav_env.simulated_data.windows import Episode, Window, wide_episode, windows_of_episodes

EPISODES_TOGETHER: Final = 20
NUM_BINS: Final = 10
HEADER: Final = (
    *("windows", "network", "number", "Q1, MSE", "Q2, MSE", "Spearman, Q1", "Q2"),
    *("mean Q1", "mean Q2", "the teacher's mean Q1", "mean Q2"),
)


@dataclass(frozen=True)
class RewardErrors:
    """Compare networks with the symmetrised teacher on windows that no training has seen."""

    weights: tuple[str, ...] = ("default",)
    """default, published or checkpoint folders."""
    episodes: int = 500
    """Episodes over the wide range, at most 12 windows each; as many of each agent, at most 8 windows each."""
    agents: tuple[str, ...] = ()
    """Agents whose visited states are measured, too."""
    seed: int = 1_000_000
    """Of the episodes; trainings use small ones."""
    images: bool = False
    """Also the mean of a network's scores of the window and of its mirror image."""
    plot: Path | None = None
    """A PNG of deviation and error, of the first weights over the wide range."""
    output: Path | None = None
    """A JSON file for the figures."""

    def run(self) -> None:
        """Measure, print, draw and write."""
        check_least(self, episodes=1, seed=0)
        scorers = {name: load_scorer(name) for name in self.weights}
        teacher = load_scorer("published")
        sets: dict[str, Episode] = {"wide range": wide_episode}
        sets |= {f"visited by {agent}": AgentEpisode(agent) for agent in self.agents}
        rows: list[dict[str, Any]] = []
        for name, episode in sets.items():
            windows, taught = _taught(name, episode, teacher, self.episodes, self.seed)
            parts = {
                f"{name}, sane": taught.in_teacher_range,
                f"{name}, beyond": ~taught.in_teacher_range & ~taught.touching,
                f"{name}, out of contact": ~taught.touching,
            }
            for network, scorer in scorers.items():
                found = scorer.assess_windows(windows)
                if self.plot is not None and not rows:
                    image = calibration(found, taught.symmetrised, ~taught.touching, network)
                    replace_file(self.plot, image)
                rows += [_row(part, network, found, taught, chosen) for part, chosen in parts.items()]
                if self.images:
                    both = _with_mirror_image(scorer, windows, found)
                    rows += [_row(part, f"{network}, two images", both, taught, mask) for part, mask in parts.items()]
        print("\n".join(_lines(rows)), flush=True)
        if self.output is not None:
            replace_file(self.output, (json.dumps(rows, indent=2) + "\n").encode())


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    return run_command("python -m benchmarks.reward_errors", RewardErrors, arguments, __doc__)


def calibration(found: Assessment, expected: Float32Array, chosen: NDArray[np.bool_], name: str) -> bytes:
    """A PNG: the root mean squared error of windows of about the same deviation, a tenth of all at each point."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5, 4), layout="constrained")
    axes = figure.subplots()
    largest = 0.0
    for column, question in enumerate(QUESTIONS):
        deviation = found.deviations[chosen, column].astype(float)
        squares = (found.scores - expected)[chosen, column].astype(float) ** 2
        tenths = np.array_split(np.argsort(deviation), NUM_BINS)
        spread = [float(deviation[each].mean()) for each in tenths]
        error = [float(np.sqrt(squares[each].mean())) for each in tenths]
        axes.plot(spread, error, marker="o", label=question.upper())
        largest = max(largest, *spread, *error)
    axes.plot((0, largest), (0, largest), color="grey", linewidth=1, linestyle="--", label="deviation = error")
    axes.set(xlabel="standard deviation of the members", ylabel="root mean squared error", title=name)
    axes.legend(frameon=False)
    image = io.BytesIO()
    figure.savefig(image, format="png", dpi=120)
    return image.getvalue()


def _taught(
    name: str, episode: Episode, teacher: SocialScorer, episodes: int, seed: int
) -> tuple[list[Window], TaughtWindows]:
    windows: list[Window] = []
    images: list[Float32Array] = []
    for first in watched(range(0, episodes, EPISODES_TOGETHER), f"simulating {name}"):
        some = windows_of_episodes(episode, seed, range(first, min(first + EPISODES_TOGETHER, episodes)))
        windows += some
        images.append(image_scores(teacher, some))
    return windows, TaughtWindows(Stars.of_windows(windows), np.concatenate(images))


def _with_mirror_image(scorer: SocialScorer, windows: list[Window], found: Assessment) -> Assessment:
    turned = [[mirrored_frame(frame, turn_walls=True) for frame in window] for window in windows]
    return found._replace(scores=(found.scores + scorer.score_windows(turned)) / 2)


def _row(
    part: str, network: str, found: Assessment, taught: TaughtWindows, chosen: NDArray[np.bool_]
) -> dict[str, Any]:
    wrong = np.abs(found.scores.clip(0, 1) - taught.symmetrised)[chosen].astype(float)
    row: dict[str, Any] = {"windows": part, "network": network, "number": int(chosen.sum())}
    for column, question in enumerate(QUESTIONS):
        row[f"{question}_mse"] = float((wrong[:, column] ** 2).mean()) if chosen.any() else None
        means = ((question, found.scores.clip(0, 1)), (f"teacher_{question}", taught.symmetrised))
        row |= {
            f"{name}_mean": float(scores[chosen, column].mean()) if chosen.any() else None for name, scores in means
        }
        row[f"{question}_spearman"] = rank_correlation(found.deviations[chosen, column], wrong[:, column])
    return row


def _lines(rows: list[dict[str, Any]]) -> list[str]:
    """A table in Markdown."""
    lines = [HEADER, ("---",) * 2 + ("---:",) * (len(HEADER) - 2)]
    for row in rows:
        means = (row[f"{name}_mean"] for name in ("q1", "q2", "teacher_q1", "teacher_q2"))
        numbers = (row["q1_mse"], row["q2_mse"], row["q1_spearman"], row["q2_spearman"], *means)
        formats = (".5f", ".5f", ".2f", ".2f", *(".3f",) * 4)
        cells = ("-" if value is None else format(value, how) for value, how in zip(numbers, formats, strict=True))
        lines.append((row["windows"], row["network"], f"{row['number']:,}", *cells))
    return [f"| {' | '.join(line)} |" for line in lines]


if __name__ == "__main__":
    sys.exit(main())
