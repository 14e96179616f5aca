"""Scenes played more slowly, so that a fast robot's lies in the range of speeds that people rated.

A scene that is played f times slower has the same geometry: the same poses along the same paths. A second of its time
is 1/f seconds of the recording, and every velocity, the people's as well as the robot's, is divided by f. Its score is
one of the original scene only as far as people judge the geometry of a motion and not its pace.
"""

from __future__ import annotations

import math
from dataclasses import replace

from reward_model.scenes.scene import SceneSequence, Snapshot


def check_factor(factor: float) -> None:
    """Raise `ValueError` for a factor that is not a positive number."""
    if not (math.isfinite(factor) and factor > 0):
        raise ValueError(f"time_scale must be a positive number, got {factor}")


def slowed(sequence: SceneSequence, factor: float) -> SceneSequence:
    """The scene played `factor` times slower; below 1 it is faster.

    Timestamps are multiplied by the factor, velocities and commands divided by it. Intervals stay: the graph's features
    are displacements over them, so these shrink as the velocities do.

    Raises:
        ValueError: For a factor that is not a positive number.
        ScenarioError: If a number of the result is too large.
    """
    check_factor(factor)
    if factor == 1:
        return sequence
    return replace(sequence, snapshots=tuple(_slowed(snapshot, factor) for snapshot in sequence))


def _slowed(snapshot: Snapshot, factor: float) -> Snapshot:
    people, objects = snapshot.people, snapshot.objects
    return replace(
        snapshot,
        timestamp=snapshot.timestamp * factor,
        command=snapshot.command / factor,
        people=replace(people, velocities=people.velocities / factor),
        objects=replace(objects, velocities=objects.velocities / factor),
    )
