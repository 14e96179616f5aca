"""What a run leaves to look at: the table of agents, the learning curve, the film of an episode."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from rich.markup import escape
from rich.table import Table

from agents.checkpoint import LearningHistory
from agents.envs import EnvironmentMaker
from agents.evaluation import Evaluation, Interval
from agents.policy import Policy, act
from reward_model.base.files import replace_file

TABLE_MEASURES = {
    "success": "arrived",
    "collision_person": "hit a person",
    "collision_object": "hit an object",
    "collision_wall": "hit a wall",
    "timeout": "out of time",
    "return": "return",
    "q1_mean": "mean Q1",
    "q2_mean": "mean Q2",
    "spl": "SPL",
    "time_to_goal": "time to goal [s]",
    "min_person_distance": "closest person [m]",
    "personal_zone": "personal zone [%]",
}
CURVE_PANELS = {"success": "Success rate", "return": "Return", "q2": "Mean Q2"}
CURVE_COLOUR, EVALUATION_COLOUR = "#7aa6c2", "#c44e52"
SMOOTHING = 5  # updates that the drawn curve averages over
PLAYBACK = 4  # films run this many times faster than the episode


def evaluation_table(evaluations: Mapping[str, Evaluation]) -> Table:
    """Return a table with a column for each agent and a row for each measure: the mean and its 95 % interval."""
    episodes = max(len(evaluation.episodes) for evaluation in evaluations.values())
    table = Table(title=f"{episodes} episodes: mean, 95 % bootstrap interval")
    table.add_column("")
    for agent in evaluations:
        table.add_column(agent, justify="right")
    for name, title in TABLE_MEASURES.items():
        intervals = [evaluation.summary.get(name) for evaluation in evaluations.values()]
        if any(interval is not None for interval in intervals):
            table.add_row(escape(title), *map(_cell, intervals))
    return table


def _cell(interval: Interval | None) -> str:
    if interval is None or not interval.episodes:
        return "-"
    return f"{interval.mean:.3g}  {interval.low:.3g}..{interval.high:.3g}"


def plot_learning_curve(history: LearningHistory, title: str, path: Path) -> None:
    """Draw success rate, return and Q2 over the timesteps, with the evaluations' means and intervals, to a PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    panels = [name for name in CURVE_PANELS if any(name in row for row in history.training)]
    figure = Figure(figsize=(4.4 * max(1, len(panels)), 3.6), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontsize=12)
    for position, name in enumerate(panels):
        axes = figure.add_subplot(1, len(panels), position + 1)
        _draw_panel(axes, history, name)
    image = io.BytesIO()
    figure.savefig(image, format="png", dpi=150)
    replace_file(path, image.getvalue())


def _draw_panel(axes: Any, history: LearningHistory, name: str) -> None:
    rows = [row for row in history.training if name in row]
    values = np.array([row[name] for row in rows])
    smooth = [values[max(0, end - SMOOTHING) : end].mean() for end in range(1, len(values) + 1)]
    axes.plot([row["timesteps"] for row in rows], smooth, color=CURVE_COLOUR, label="training")
    points = [row for row in history.evaluations if name in row]
    if points:
        means = np.array([row[name]["mean"] for row in points])
        below = means - [row[name]["low"] for row in points]
        above = [row[name]["high"] for row in points] - means
        axes.errorbar(
            [row["timesteps"] for row in points],
            means,
            yerr=[below, above],
            fmt="o",
            markersize=4,
            capsize=2,
            color=EVALUATION_COLOUR,
            label="evaluation, 95 % interval",
        )
    axes.set_title(CURVE_PANELS[name], fontsize=10)
    axes.set_xlabel("timesteps")
    if name == "success":
        axes.set_ylim(-0.02, 1.02)
    axes.xaxis.set_major_formatter(lambda value, _: f"{value / 1000:g}k" if value else "0")
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(fontsize=8, frameon=False)


def film_episode(policy: Policy, make: EnvironmentMaker, seed: int, path: Path) -> None:
    """Play one episode and write it as a looping GIF, four times as fast as it happened."""
    import imageio.v3 as imageio

    env = make(render_mode="rgb_array")
    try:
        observation, _ = env.reset(seed=seed)
        frames: list[Any] = [env.render()]
        ended = False
        while not ended:
            observation, _, terminated, truncated, _ = env.step(act(policy, env, observation))
            frames.append(env.render())
            ended = terminated or truncated
        rate = float(env.metadata.get("render_fps", 5))
    finally:
        env.close()
    duration = max(20, round(1000 / (rate * PLAYBACK)))  # ms a frame; viewers slow down anything shorter
    film: Any = imageio.imwrite("<bytes>", np.stack(frames), extension=".gif", duration=duration, loop=0)
    replace_file(path, bytes(film))
