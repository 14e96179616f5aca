"""Scenes from ordinary to far beyond sense, each determined by a seed and a number."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import MappingProxyType
from typing import Final

import numpy as np

from benchmarks.robustness.clearance import clearance
from benchmarks.robustness.extreme_scenes import extreme_scene, limit_scene
from benchmarks.robustness.simulated_rooms import contact_scene, room_scene
from reward_model.scenes.scene import SceneSequence

_SCENES_OF_A_ROOM: Final = 20  # of each kind, so that simulating takes less time than scoring

KINDS: Final = MappingProxyType[str, Callable[[int, int, np.random.Generator], SceneSequence]](
    {
        "room": room_scene,
        "contact": contact_scene,
        "extreme": lambda _seed, _room, rng: extreme_scene(rng),
        "limits": lambda _seed, _room, rng: limit_scene(rng),
    }
)
"""Functions of a seed, the number of a room and a generator, by the kind of scene; kinds take turns."""

ORDINARY: Final = frozenset({"room", "contact"})


def kind_of(index: int) -> str:
    """The kind of scene number `index`."""
    return list(KINDS)[index % len(KINDS)]


def odd_scene(seed: int, index: int) -> SceneSequence:
    """Scene number `index` of a seed; it does not depend on other scenes or the process."""
    kind, place = kind_of(index), index // len(KINDS)
    scene = KINDS[kind](seed, place // _SCENES_OF_A_ROOM, np.random.default_rng([seed, index]))
    return replace(scene, name=f"{kind} {index}")


def described(scene: SceneSequence) -> str:
    """The main facts of a scene in one line."""
    newest = scene.last
    gap = clearance(newest)
    parts = [
        f"{len(scene)} snapshots",
        f"{len(newest.people)} people",
        f"{len(newest.objects)} objects",
        f"{len(newest.walls)} walls within {_largest(newest.walls)} m",
        f"goal at {_largest(newest.goal)} m",
        f"command {', '.join(f'{number:.3g}' for number in newest.command.tolist())}",
        f"places within {_largest(newest.people.poses[:, :2], newest.objects.poses[:, :2])} m",
        f"speeds up to {_largest(newest.people.velocities, newest.objects.velocities)}",
        f"clearance {gap:.3g} m",
    ]
    return "; ".join(parts)


def _largest(*arrays: np.ndarray) -> str:
    return f"{max(float(np.abs(each).max(initial=0.0)) for each in arrays):.3g}"
