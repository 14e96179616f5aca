"""What happens while PPO learns: progress on the terminal, learning curve, evaluations, checkpoints, stopping."""

from __future__ import annotations

import signal
from collections import deque
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

from agents.checkpoint import CHECKPOINT_FILE, LearningHistory, save_checkpoint
from agents.config import RunConfig
from agents.evaluation import Evaluation

WINDOW = 100  # episodes the running means are taken over
CURVE_MEASURES = {"success": "success", "return": "return", "q2": "q2_mean"}  # and their names in evaluations


class StopRequest:
    """Turns the first Ctrl-C (or SIGTERM) into a request to stop at the next step; a second one interrupts at once."""

    def __init__(self) -> None:
        self.made = False
        self._previous: dict[signal.Signals, Any] = {}

    def __enter__(self) -> StopRequest:
        for number in (signal.SIGINT, signal.SIGTERM):
            self._previous[number] = signal.signal(number, self._handle)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._previous.items():
            signal.signal(number, handler)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if self.made:
            raise KeyboardInterrupt
        self.made = True


class TrainingCallback(BaseCallback):
    """Runs between PPO's updates.

    Args:
        config: the run's intervals.
        folder: where checkpoints go.
        history: rows are added to it.
        evaluate_now: evaluates the policy as it is.
        stop: whether the user asked to stop.
        console: where to report.
    """

    model: PPO

    def __init__(
        self,
        config: RunConfig,
        folder: Path,
        history: LearningHistory,
        evaluate_now: Callable[[PPO], Evaluation],
        stop: StopRequest,
        console: Console,
    ) -> None:
        super().__init__()
        self.config, self.folder, self.history = config, folder, history
        self._evaluate_now, self._stop, self._console = evaluate_now, stop, console
        self._episodes: deque[dict[str, float]] = deque(maxlen=WINDOW)
        self._q2: list[float] = []
        self._progress = Progress(
            TextColumn("training"),
            BarColumn(),
            TextColumn("{task.completed:,.0f}/{task.total:,.0f} steps"),
            TextColumn("{task.fields[state]}"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            console=console,
        )

    @property
    def control_steps(self) -> int:
        """Control steps trained for so far; SB3 counts actions."""
        return self.num_timesteps * self.config.action_repeat

    def _on_training_start(self) -> None:
        self._evaluated = self._saved = self.control_steps
        self._task = self._progress.add_task(
            "training", total=self.config.total_timesteps, completed=self.control_steps, state=""
        )
        self._progress.start()

    def _on_rollout_start(self) -> None:
        if self.control_steps - self._evaluated >= self.config.evaluation_interval:
            self._evaluated = self.control_steps
            self._evaluate()
        if self.control_steps - self._saved >= self.config.checkpoint_interval:
            self._saved = self.control_steps
            save_checkpoint(self.folder / CHECKPOINT_FILE, self.model, self.history)

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "q2" in info:
                self._q2.append(float(info["q2"]))
            if "episode" in info:
                episode = info["episode"]
                self._episodes.append({"return": float(episode["r"]), "success": float(episode["is_success"])})
        self._progress.update(self._task, completed=min(self.control_steps, self.config.total_timesteps))
        return not self._stop.made

    def _on_rollout_end(self) -> None:
        row: dict[str, float] = {"timesteps": float(self.control_steps)}
        for name in ("success", "return"):
            if self._episodes:
                row[name] = float(np.mean([episode[name] for episode in self._episodes]))
        if self._q2:
            row["q2"] = float(np.mean(self._q2))
            self.logger.record("rollout/q2", row["q2"])
            self._q2.clear()
        self.history.training.append(row)
        shown = [f"{name} {row[name]:.2f}" for name in CURVE_MEASURES if name in row]
        self._progress.update(self._task, state=", ".join(shown))

    def _on_training_end(self) -> None:
        self.close()

    def close(self) -> None:
        """Take the progress bar down."""
        self._progress.stop()

    def _evaluate(self) -> None:
        summary = self._evaluate_now(self.model).summary
        measures = {name: summary[key] for name, key in CURVE_MEASURES.items() if key in summary}
        row: dict[str, Any] = {"timesteps": float(self.control_steps)}
        for name, interval in measures.items():
            row[name] = {"mean": interval.mean, "low": interval.low, "high": interval.high}
            self.logger.record(f"evaluation/{name}", interval.mean)
        self.history.evaluations.append(row)
        shown = ", ".join(f"{name} {interval.mean:.2f}" for name, interval in measures.items())
        self._console.print(
            f"after {self.control_steps:,} steps, over {self.config.evaluation_episodes} episodes: {shown}"
        )
