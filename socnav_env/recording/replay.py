"""Replay of recorded episodes: to verify them, without the robot, or as input of the reward model."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from reward_model.base.arrays import FloatArray
from reward_model.graph.frame import FrameGraph
from reward_model.scenes.scene import SceneSequence
from reward_model.scenes.time_scale import slowed
from socnav_env.episode import STANDING, Episode
from socnav_env.layout import Layout
from socnav_env.recording.arrays import RecordingError
from socnav_env.recording.files import Recording
from socnav_env.simulation.snapshots import Recorder
from socnav_env.simulation.world import World
from socnav_env.trajectories.trajectory import Trajectory
from socnav_env.trajectories.versions import simulation_versions

STATES = ("robot_poses", "robot_velocities", "people_poses", "people_velocities", "people_targets")
OUT_OF_REACH = 1000.0  # m from the room, the place of a robot that nobody must notice


@dataclass(frozen=True)
class Difference:
    """The first difference between a replayed episode and its recording.

    Attributes:
        step: 0 for the start
        what: the array's name, or "outcome"
    """

    step: int
    what: str
    recorded: str
    repeated: str

    def __str__(self) -> str:
        return f"{self.what} differs first at step {self.step}: recorded {self.recorded}, repeated {self.repeated}"


def replay(recording: Recording) -> Trajectory:
    """Simulate a recording again from its layout, random state and commands, without scores.

    Raises:
        RecordingError: If it was simulated by other versions, which may differ in insignificant bits.
    """
    trajectory = recording.trajectory
    return _simulate(recording, trajectory.layout, trajectory.commands)


def rerun_without_robot(recording: Recording) -> Trajectory:
    """Simulate a recording again without the robot, for the same time; see `person_detour`.

    The robot is absent from the warm-up on. In the result it stands far outside of the room.

    Raises:
        RecordingError: Like `replay`.
    """
    layout = recording.trajectory.layout
    away = np.array([layout.room.corners[:, 0].max() + OUT_OF_REACH, 0.0, 0.0])
    script = layout.script
    if script is not None:
        gone = np.broadcast_to(away, script.robot_poses.shape)
        script = replace(script, robot_poses=gone, commands=np.zeros_like(script.commands))
    layout = replace(layout, robot_pose=away, script=script)
    return _simulate(recording, layout, np.zeros_like(recording.trajectory.commands))


def first_difference(recorded: Trajectory, repeated: Trajectory) -> Difference | None:
    """The first difference between the bits of two episodes with the same commands; None if there is none."""
    found = [each for each in (_first_row(name, recorded, repeated) for name in STATES) if each is not None]
    if found:
        return min(found, key=lambda difference: difference.step)
    if recorded.outcome is not None and recorded.outcome is not repeated.outcome:
        return Difference(len(recorded), "outcome", str(recorded.outcome), str(repeated.outcome))
    return None


def recorded_sequence(recording: Recording, name: str) -> SceneSequence:
    """The whole episode in real time, with its warm-up, as the reward model's scene: a snapshot every control period.

    Raises:
        RecordingError: Like `replay`.
    """
    return SceneSequence(tuple(recorder.snapshots[-1] for recorder in _recorders(recording)), name=name)


def recorded_windows(recording: Recording) -> list[list[FrameGraph]]:
    """The window of frames scored for each step of the episode, see `SocialScorer.score_windows`.

    Raises:
        RecordingError: Like `replay`.
    """
    skipped = recording.config.warm_up_steps + 1
    return [recorder.window() for recorder in _recorders(recording)][skipped:]


def recorded_sequences(recording: Recording) -> list[SceneSequence]:
    """The last two seconds at the start and after each step as the scenes that are scored, see `Episode`.

    Raises:
        RecordingError: Like `replay`.
    """
    skipped, time_scale = recording.config.warm_up_steps, recording.config.reward.time_scale
    return [
        slowed(SceneSequence(recorder.snapshots, recording.name), time_scale) for recorder in _recorders(recording)
    ][skipped:]


def _recorders(recording: Recording) -> Iterator[Recorder]:
    """The same recorder after each of its snapshots."""
    world = _world(recording, recording.trajectory.layout)
    recorder = Recorder(world, recording.config.control_period, recording.config.reward.time_scale)
    yield recorder
    for command in [*[STANDING] * recording.config.warm_up_steps, *recording.trajectory.commands]:
        world.advance(command)
        recorder.record()
        yield recorder


def _simulate(recording: Recording, layout: Layout, commands: FloatArray) -> Trajectory:
    episode = Episode(_world(recording, layout), recording.config, judged=False)
    for command in commands:
        episode.advance(command)
        episode.conclude(None)
    return episode.trajectory()


def _world(recording: Recording, layout: Layout) -> World:
    versions = simulation_versions()
    if recording.versions != versions:
        raise RecordingError(
            f"{recording.name}: must be simulated by the versions that recorded it, {_shown(recording.versions)}; "
            f"these are {_shown(versions)}"
        )
    return World(layout, recording.config, recording.generator())


def _shown(versions: dict[str, str]) -> str:
    return ", ".join(f"{name} {versions[name]}" for name in sorted(versions))


def _first_row(name: str, recorded: Trajectory, repeated: Trajectory) -> Difference | None:
    one, other = (np.ascontiguousarray(getattr(each, name)) for each in (recorded, repeated))
    differs = (one.view(np.int64) != other.view(np.int64)).reshape(len(one), -1)
    if not differs.any():
        return None
    row, column = (int(each) for each in np.argwhere(differs)[0])
    values = (repr(float(each.reshape(len(each), -1)[row, column])) for each in (one, other))
    return Difference(row, name, *values)
