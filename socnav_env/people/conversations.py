"""Conversations during an episode: people who join them and people who leave them."""

from __future__ import annotations

import math
from itertools import combinations
from typing import NamedTuple

import numpy as np

from reward_model.base.arrays import FloatArray, IntArray
from socnav_env.config import EnvConfig
from socnav_env.layout import Layout
from socnav_env.people.interactions import changed, interactions_of, occupied, standing_groups
from socnav_env.people.social_force import ARRIVED, first_in_sight
from socnav_env.people.walkers import Surroundings, Walkers


class _Joining(NamedTuple):
    """A person on the way to join a conversation: its members, and the place (2,) to go to."""

    talkers: list[int]
    place: FloatArray


class Conversations:
    """Conversations that people join and leave at the rates in `population.conversations`.

    Members are walkers who stand still, so that they can leave. People who wander alone may join; their place is in the
    widest gap between the members. If one of the last two members leaves, both do.

    interactions: the current interactions
    changes: (row, one, other, begins) of every pair that began (1) or ended (0), in order; row 0: before the start
    """

    def __init__(self, layout: Layout, config: EnvConfig, rows: IntArray, walkers: Walkers, poses: FloatArray) -> None:
        """rows: (num_walkers,) index of each walker among the people; poses: (num_walkers, 3)."""
        self.interactions = interactions_of(layout)
        self.changes: list[tuple[int, int, int, int]] = []
        self._config, self._people = config, rows
        walker_of = {int(person): walker for walker, person in enumerate(rows)}
        self._groups = [[walker_of[person] for person in group] for group in standing_groups(layout)]
        self._alone = (layout.people_group[rows] < 0) & ~occupied(layout)[rows]
        self._joining: dict[int, _Joining] = {}
        for walker in self.talkers():
            walkers.time_left[walker], walkers.facing[walker] = np.inf, poses[walker, 2]
            self._alone[walker] = True

    def update(
        self, row: int, walkers: Walkers, bodies: FloatArray, around: Surroundings, rng: np.random.Generator
    ) -> None:
        """Let people leave, arrive and decide to join, before a control period.

        Args:
            row: row of the trajectory that the period leads to
            bodies: (num_walkers or more, 2 or more) x, y of the walkers
        """
        period, rates = self._config.control_period, self._config.population.conversations
        for walker in self.talkers():
            walkers.blocked[walker] = 0.0
        for walker in self._chosen(self.talkers(), rates.leave_rate * period, rng):
            self._leave(walker, row, walkers)
        for walker in list(self._joining):
            self._finish_joining(walker, row, walkers, bodies)
        for walker in self._chosen(self._wanderers(), rates.join_rate * period, rng):
            self._set_out(walker, walkers, bodies, around, rng)

    def talkers(self) -> list[int]:
        """The walkers who talk with anyone."""
        return [walker for group in self._groups for walker in group]

    def _wanderers(self) -> list[int]:
        busy = {*self.talkers(), *self._joining}
        return [walker for walker in np.flatnonzero(self._alone).tolist() if walker not in busy]

    def _chosen(self, walkers: list[int], chance: float, rng: np.random.Generator) -> list[int]:
        if chance == 0.0:
            return []
        return [walker for walker, drawn in zip(walkers, rng.random(len(walkers)), strict=True) if drawn < chance]

    def _leave(self, walker: int, row: int, walkers: Walkers) -> None:
        for group in self._groups:
            if walker in group:
                leaving = [walker] if len(group) > 2 else list(group)
                self._record(row, _pairs_with(leaving, group), begins=False)
                for each in leaving:
                    group.remove(each)
                    _send_off(each, walkers)
        self._groups = [group for group in self._groups if group]

    def _finish_joining(self, walker: int, row: int, walkers: Walkers, bodies: FloatArray) -> None:
        """Join if the place has been reached; give up if the way is blocked or nobody is left."""
        talkers, place = self._joining[walker]
        if not talkers or walkers.blocked[walker] > self._config.people.patience:
            del self._joining[walker]
            _send_off(walker, walkers)
        elif math.dist(bodies[walker, :2].tolist(), place.tolist()) < ARRIVED:
            del self._joining[walker]
            way = bodies[talkers, :2].mean(axis=0) - place
            walkers.facing[walker] = math.atan2(way[1], way[0])
            self._record(row, [(walker, other) for other in talkers], begins=True)
            talkers.append(walker)

    def _set_out(
        self, walker: int, walkers: Walkers, bodies: FloatArray, around: Surroundings, rng: np.random.Generator
    ) -> None:
        """Head for a conversation that is not full, if the straight way to its free place is clear."""
        expected = [group for group in self._groups if self._size(group) < self._most]
        if not expected:
            return
        talkers = expected[int(rng.integers(len(expected)))]
        spacing, clearance = self._config.population.circle_spacing[0], self._config.people.clearance
        place = free_place(bodies[[*talkers, *self._expected_by(talkers)], :2], spacing)
        if first_in_sight(bodies[walker, :2].copy(), place[None], clearance, *around) == 0:
            self._joining[walker] = _Joining(talkers, place)
            walkers.target[walker], walkers.time_left[walker], walkers.blocked[walker] = place, np.inf, 0.0

    @property
    def _most(self) -> int:
        return self._config.population.conversations.max_size

    def _expected_by(self, talkers: list[int]) -> list[int]:
        return [walker for walker, joining in self._joining.items() if joining.talkers is talkers]

    def _size(self, talkers: list[int]) -> int:
        return len(talkers) + len(self._expected_by(talkers))

    def _record(self, row: int, pairs: list[tuple[int, int]], begins: bool) -> None:
        people = [sorted((int(self._people[one]), int(self._people[other]))) for one, other in pairs]
        self.changes += [(row, one, other, int(begins)) for one, other in people]
        for pair in people:
            self.interactions = changed(self.interactions, pair, begins)


def _pairs_with(some: list[int], everyone: list[int]) -> list[tuple[int, int]]:
    """All pairs of `everyone` that include at least one of `some`."""
    return [pair for pair in combinations(everyone, 2) if not set(some).isdisjoint(pair)]


def free_place(talkers: FloatArray, spacing: float) -> FloatArray:
    """A place (2,) in the widest gap around people at (n, 2): on their circle, or farther out if that is too close.

    Args:
        spacing: [m] minimum distance to each of them
    """
    middle = talkers.mean(axis=0)
    offsets = talkers - middle
    angles = np.sort(np.arctan2(offsets[:, 1], offsets[:, 0]))
    gaps = np.diff(angles, append=angles[0] + 2 * math.pi)
    widest = int(gaps.argmax())
    angle = angles[widest] + gaps[widest] / 2
    way = np.array([math.cos(angle), math.sin(angle)])
    along, beside = offsets @ way, offsets @ [-way[1], way[0]]
    far_enough = along + np.sqrt(np.maximum(0.0, spacing**2 - beside**2))
    radius = np.hypot(offsets[:, 0], offsets[:, 1]).mean()
    return np.asarray(middle + max(radius, far_enough[np.abs(beside) < spacing].max(initial=0.0)) * way)


def _send_off(walker: int, walkers: Walkers) -> None:
    """Make a walker a wanderer who needs a target."""
    walkers.time_left[walker], walkers.blocked[walker], walkers.facing[walker] = 0.0, 0.0, np.nan
