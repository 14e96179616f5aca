"""Simulation of all people of a recording at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from benchmarks.realism.crowd_replay import LEAST_SPEED, STEP, STEPS_A_ROW
from benchmarks.realism.tracks import FRAME_PERIOD, Track
from reward_model.base.arrays import BoolArray, FloatArray, IntArray
from socnav_env.config import PeopleConfig
from socnav_env.people.social_force import SLOW_DOWN, walk
from socnav_env.people.walkers import Surroundings, Walkers, habits_of

MOST_TIME = 2.0  # times the real person's duration, after which a simulated one is removed


class Crowd(NamedTuple):
    """Statistics of a crowd, over all people and rows.

    Attributes:
        speeds: [m/s] over the 0.4 s before
        neighbours: [m] from each person to the nearest other
    """

    speeds: FloatArray
    neighbours: FloatArray


def real_crowd(tracks: list[Track]) -> Crowd:
    """The crowd as recorded."""
    rows = max(track.first + len(track.places) for track in tracks)
    places = np.full((rows, len(tracks), 2), np.nan)
    for number, track in enumerate(tracks):
        places[track.first : track.first + len(track.places), number] = track.places
    return _crowd(places)


def simulated_crowd(tracks: list[Track], groups: IntArray, people: PeopleConfig) -> Crowd:
    """The simulated crowd: people enter as recorded, and walk with their companions to the mean of their exits.

    Args:
        groups: a number for each track, the same for companions
    """
    walkers = _walkers(tracks, groups)
    habits, nowhere = habits_of(people), Surroundings(np.empty((0, 4)), np.empty((0, 3)), np.empty((0, 6)))
    entries = np.array([track.first for track in tracks])
    latest = entries + np.ceil(MOST_TIME * np.array([len(track.places) for track in tracks])).astype(int)
    states, gone = _entering(tracks), np.zeros(len(tracks), dtype=np.bool_)
    places = np.full((latest.max(), len(tracks), 2), np.nan)
    for row in range(len(places)):
        gone |= (row >= latest) | _arrived(states, walkers, (entries <= row) & ~gone)
        present = np.flatnonzero((entries <= row) & ~gone)
        places[row, present] = states[present, :2]
        for _ in range(STEPS_A_ROW if len(present) else 0):
            # The last row is the robot's, which nobody notices.
            bodies, velocities = np.vstack([states[present], np.zeros(6)]), np.zeros((len(present) + 1, 3))
            own = Walkers(*(each[present] for each in walkers))
            walk(STEP, bodies, own, 0.0, 0.0, nowhere, habits, velocities)
            states[present, 3:] = velocities[:-1]
            states[present, :3] += STEP * velocities[:-1]
    return _crowd(places)


def _walkers(tracks: list[Track], groups: IntArray) -> Walkers:
    entering = np.array([np.linalg.norm(track.places[1] - track.places[0]) / FRAME_PERIOD for track in tracks])
    targets, speeds = np.array([track.places[-1] for track in tracks]), np.maximum(entering, LEAST_SPEED)
    count = len(tracks)
    spacing, none = np.zeros(count), np.full(count, np.nan)
    for group in np.unique(groups):
        members = np.flatnonzero(groups == group)
        targets[members], speeds[members] = targets[members].mean(axis=0), speeds[members].mean()
        spacing[members] = _spacing([tracks[member] for member in members])
    return Walkers(speeds, groups, spacing, targets, np.zeros(count), np.zeros(count), none)


def _spacing(companions: list[Track]) -> float:
    """Distance [m] between neighbours when the last companion enters; those who have left count at their last place."""
    row = max(track.first for track in companions)
    places = np.array([track.places[min(row - track.first, len(track.places) - 1)] for track in companions])
    extent = np.linalg.norm(places[:, None] - places, axis=2).max()
    return float(extent / max(len(companions) - 1, 1))


def _entering(tracks: list[Track]) -> FloatArray:
    """States (n, 6) as `walk` has them, at the first row of each track."""
    states = np.zeros((len(tracks), 6))
    for state, track in zip(states, tracks, strict=True):
        velocity = (track.places[1] - track.places[0]) / FRAME_PERIOD
        state[:2], state[2], state[3:5] = track.places[0], np.arctan2(velocity[1], velocity[0]), velocity
    return states


def _arrived(states: FloatArray, walkers: Walkers, present: BoolArray) -> BoolArray:
    """Whether each person's group is near enough to slow down for its target, (n,)."""
    arrived = np.zeros(len(states), dtype=np.bool_)
    for group in np.unique(walkers.group[present]):
        members = present & (walkers.group == group)
        way = walkers.target[members][0] - states[members, :2].mean(axis=0)
        arrived[members] = np.hypot(way[0], way[1]) < SLOW_DOWN
    return arrived


def _crowd(places: FloatArray) -> Crowd:
    """Statistics of places (rows, n, 2) [m], NaN where a person is absent."""
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=2) / FRAME_PERIOD
    neighbours = []
    for row in places:
        here = row[~np.isnan(row[:, 0])]
        if len(here) > 1:
            apart = np.linalg.norm(here[:, None] - here, axis=2)
            np.fill_diagonal(apart, np.inf)
            neighbours.append(apart.min(axis=1))
    return Crowd(speeds[~np.isnan(speeds)], np.concatenate(neighbours))
