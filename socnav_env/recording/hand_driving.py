"""The robot driven by hand, in a window."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from socnav_env.config.robot import COMPONENTS, TURN, RobotConfig
from socnav_env.env import SocNavEnv
from socnav_env.recording.files import record_episode, write_recording
from socnav_env.trajectories.outcomes import Outcome


def play_by_hand(env: SocNavEnv, seed: int, file: Path | None = None) -> Iterator[Outcome | None]:
    """Play episodes until the window is closed; yields how each ended, None for one that was broken off.

    Args:
        env: rendered for people
        seed: of the first episode
        file: for a recording of the first episode; those of later ones are written beside it, with numbers
    """
    number = 0
    try:
        while not _is_over(env):
            number += 1
            env.reset(seed=seed + number - 1)
            outcome = _drive(env)
            if file is not None and len(env.trajectory):
                write_recording(record_episode(env), file if number == 1 else file.with_stem(f"{file.stem}-{number}"))
            yield outcome
            _wait(env)
    finally:
        env.close()


def _drive(env: SocNavEnv) -> Outcome | None:
    """Take the wheel until the episode ends or the window is closed."""
    outcome = None
    while outcome is None and not env.controls.quit:
        outcome = env.step(_action(env.controls.drive, env.config.robot))[4]["outcome"]
    return None if outcome is None else Outcome(outcome)


def _is_over(env: SocNavEnv) -> bool:
    return env.has_scene and env.controls.quit


def _wait(env: SocNavEnv) -> None:
    """Show how it ended until the next episode, or the end, is asked for."""
    env.controls.again = False
    while not (env.controls.again or env.controls.quit):
        env.render()


def _action(wanted: tuple[float, float, float], robot: RobotConfig) -> list[float]:
    """The action for hand controls of forward, left and turn; an axis of another name is steered like a turn."""
    controls = dict(zip(COMPONENTS, wanted, strict=True))
    return [controls.get(axis, controls[TURN]) for axis in robot.drive_type.axes]
