"""The properties that scores of any scene should have, and their measurement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Final, Protocol

import numpy as np

from benchmarks.robustness.clearance import in_contact
from benchmarks.robustness.scenes import ORDINARY
from reward_model.base.arrays import Float32Array, IntArray
from reward_model.data.augmentation import mirrored
from reward_model.scenes.scene import Objects, People, ScenarioError, SceneSequence, Snapshot

SAME = 1e-5  # the largest difference between scores that should be the same
TOUCHING = float(np.float32(0.05))  # the highest score in contact

SCORED, BOUNDED, CONTACT, MIRRORED, REVERSED, PERMUTED, BATCHED = (
    "scored",
    "bounded",
    "contact",
    "mirrored",
    "walls reversed",
    "permuted",
    "batched",
)
PROPERTIES: Final = MappingProxyType(
    {
        SCORED: "is scored, or refused by an error that names the rule",
        BOUNDED: "both scores are finite and in 0..1; worst: the distance from there",
        CONTACT: f"at most {TOUCHING:g} in contact with a person, an object or a wall; worst: the score",
        MIRRORED: f"the mirror image differs by at most {SAME:g}",
        REVERSED: f"with walls listed from their other ends it differs by at most {SAME:g}",
        PERMUTED: f"with walls, people and objects in another order it differs by at most {SAME:g}",
        BATCHED: "of ordinary scenes: is the same in a batch and alone",
    }
)


class SequenceScorer(Protocol):
    """A scorer of sequences, such as `SocialScorer`."""

    def score_batch(self, sequences: Sequence[SceneSequence]) -> Float32Array:
        """Q1 and Q2 of sequences, (num_sequences, 2)."""
        ...


@dataclass
class Tally:
    """The result of a property on the scenes of one kind.

    Attributes:
        checked, failed: number of scenes
        refused: number of scenes that the graph refuses by a `ScenarioError`
        worst: the largest value found, infinite for scores that are not finite
        scene: the first scene with that value; None where nothing was checked
        problem: the error of that scene, empty where there was none
    """

    checked: int = 0
    failed: int = 0
    refused: int = 0
    worst: float = -np.inf
    scene: SceneSequence | None = None
    problem: str = ""

    def add(self, value: float, limit: float, scene: SceneSequence, problem: str = "") -> None:
        """Count a scene, which fails where its value is above the limit."""
        self.checked += 1
        self.failed += value > limit
        if value > self.worst:
            self.worst, self.scene, self.problem = value, scene, problem


@dataclass
class Survey:
    """Counts the properties of one scorer's scores over any number of scenes.

    Attributes:
        tallies: by property and kind of scene
    """

    scorer: SequenceScorer
    tallies: dict[tuple[str, str], Tally] = field(default_factory=dict)

    def check(self, kind: str, scenes: Sequence[SceneSequence]) -> None:
        """Check all properties on scenes of one kind, which are also scored as one batch where they are ordinary."""
        alone = [self._check_alone(kind, scene) for scene in scenes]
        scored = [(scene, scores) for scene, scores in zip(scenes, alone, strict=True) if scores is not None]
        if kind in ORDINARY and scored:
            together = self.scorer.score_batch([scene for scene, _ in scored])
            for (scene, scores), others in zip(scored, together, strict=True):
                self._tally(BATCHED, kind).add(_difference(scores, others), 0.0, scene)

    def _check_alone(self, kind: str, scene: SceneSequence) -> Float32Array | None:
        """Check everything but batches, and return the scores (2,), or None where there are none."""
        tally = self._tally(SCORED, kind)
        try:
            scores = self._score(scene)
        except ScenarioError:
            tally.refused += 1
            tally.add(0.0, 0.0, scene)
            return None
        except Exception as error:  # whatever it is, it is a finding
            tally.add(np.inf, 0.0, scene, f"{type(error).__name__}: {error}")
            return None
        tally.add(0.0, 0.0, scene)
        self._tally(BOUNDED, kind).add(_excess(scores), 0.0, scene)
        if in_contact(scene.last):
            self._tally(CONTACT, kind).add(_largest(scores), TOUCHING, scene)
        order = np.random.default_rng([len(scene.last.people), len(scene.last.walls)])
        for name, other in (
            (MIRRORED, mirrored(scene)),
            (REVERSED, walls_reversed(scene)),
            (PERMUTED, permuted(scene, order)),
        ):
            self._tally(name, kind).add(_difference(scores, self._score(other)), SAME, scene)
        return scores

    def _score(self, scene: SceneSequence) -> Float32Array:
        scores: Float32Array = self.scorer.score_batch([scene])[0]
        return scores

    def _tally(self, name: str, kind: str) -> Tally:
        return self.tallies.setdefault((name, kind), Tally())


def walls_reversed(scene: SceneSequence) -> SceneSequence:
    """The scene with every wall listed from its other end."""
    return replace(scene, snapshots=tuple(replace(each, walls=each.walls[:, [2, 3, 0, 1]]) for each in scene))


def permuted(scene: SceneSequence, rng: np.random.Generator) -> SceneSequence:
    """The scene with its walls in another order, the same in all snapshots, and people and objects in any order."""
    walls = rng.permutation(len(scene.last.walls))
    return replace(scene, snapshots=tuple(_permuted_snapshot(each, walls, rng) for each in scene))


def _permuted_snapshot(snapshot: Snapshot, walls: IntArray, rng: np.random.Generator) -> Snapshot:
    people, objects = snapshot.people, snapshot.objects
    first, second = rng.permutation(len(people)), rng.permutation(len(objects))
    return replace(
        snapshot,
        walls=snapshot.walls[walls],
        people=People(people.ids[first], people.poses[first], people.velocities[first]),
        objects=Objects(objects.ids[second], objects.poses[second], objects.velocities[second], objects.sizes[second]),
    )


def _largest(values: Float32Array) -> float:
    """The largest value, infinite where one is not finite."""
    return float(values.max()) if np.isfinite(values).all() else np.inf


def _excess(scores: Float32Array) -> float:
    """How far scores are outside 0..1, 0 for those inside."""
    return _largest(np.maximum(np.maximum(scores - 1, -scores), 0))


def _difference(scores: Float32Array, others: Float32Array) -> float:
    """The largest difference, infinite where one is not finite on either side."""
    with np.errstate(invalid="ignore", over="ignore"):
        return _largest(np.abs(scores - others))
