"""Measures of episodes in files: recordings of our own and scenes in SocNav2's format."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace

import numpy as np

from reward_model.graph.frame import FrameGraph
from reward_model.graph.windows import frame_graph, select_window, wall_segments
from reward_model.scenes.scene import ScenarioError, SceneSequence
from reward_model.scenes.socnav2_json import read_socnav2
from reward_model.scorer import load_scorer
from socnav_env.metrics import episode_metrics
from socnav_env.recording.files import read_recording
from socnav_env.recording.replay import recorded_windows, rerun_without_robot
from socnav_env.trajectories.from_socnav2 import trajectory_of_sequence
from socnav_env.trajectories.trajectory import Trajectory


@dataclass(frozen=True)
class Measured:
    """The measures of an episode by name, and the name of the weights that scored it, None without scores."""

    metrics: dict[str, float]
    scorer: str | None


def measure_recording(path: str | os.PathLike[str], weights: str | None, without_robot: bool) -> Measured:
    """Measure a recording.

    Args:
        weights: weights to score it with, instead of the recorded scores
        without_robot: whether to simulate it again without the robot, for `person_detour` and `person_delay`

    Raises:
        RecordingError: For an invalid file, and where it has to be simulated again but cannot.
    """
    recording = read_recording(path)
    trajectory, scorer = recording.trajectory, recording.scorer
    if weights is not None:
        trajectory, scorer = _scored(trajectory, recorded_windows(recording), weights)
    return Measured(episode_metrics(trajectory, rerun_without_robot(recording) if without_robot else None), scorer)


def measure_scene(
    path: str | os.PathLike[str], weights: str | None, robot_radius: float, people_radius: float
) -> Measured:
    """Measure a scene, see `trajectory_of_sequence`.

    Args:
        weights: weights to score its steps with

    Raises:
        ScenarioError: For an invalid file or one without robot poses.
    """
    sequence = read_socnav2(path)
    try:
        trajectory = trajectory_of_sequence(sequence, robot_radius, people_radius)
    except ScenarioError as error:
        raise ScenarioError(f"{os.fspath(path)}: {error}") from None
    scorer = None
    if weights is not None:
        trajectory, scorer = _scored(trajectory, _windows(sequence), weights)
    return Measured(episode_metrics(trajectory), scorer)


def _scored(trajectory: Trajectory, windows: list[list[FrameGraph]], weights: str) -> tuple[Trajectory, str]:
    """The episode with new scores, one for each window, and the name of the weights."""
    scorer = load_scorer(weights)
    scores = np.asarray(scorer.score_windows(windows), dtype=np.float64).reshape(-1, 2)
    return replace(trajectory, scores=scores), scorer.name


def _windows(sequence: SceneSequence) -> list[list[FrameGraph]]:
    """The window of frames scored for each snapshot but the first."""
    segments = wall_segments(sequence.snapshots[0].walls)
    frames = [frame_graph(snapshot, segments) for snapshot in sequence]
    times = [snapshot.timestamp for snapshot in sequence]
    return [[frames[index] for index in select_window(times[:end])] for end in range(2, len(times) + 1)]
