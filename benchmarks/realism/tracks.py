"""Tracks of real pedestrians, and walks of 4.8 s among others taken from them."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from reward_model.base.arrays import FloatArray, IntArray

FRAME_PERIOD = 0.4  # s between the rows of a track
FRAMES_A_ROW = 10  # video frames
HORIZON = 12  # rows that are simulated: 4.8 s


class TracksError(ValueError):
    """A file of tracks is missing or not valid."""


class Track(NamedTuple):
    """One person: `places` (n, 2) [m], a row every 0.4 s from row `first` on of the recording."""

    first: int
    places: FloatArray


class Walks(NamedTuple):
    """Many walks of 4.8 s: n walks, with at most m others present in each.

    Attributes:
        paths: (n, HORIZON + 1, 2) [m]
        velocities: (n, 2) [m/s] over the row before the start
        exits: (n, 2) [m] last place of the whole track
        others: (n, m, HORIZON + 1, 2) [m] everyone else, NaN while absent
    """

    paths: FloatArray
    velocities: FloatArray
    exits: FloatArray
    others: FloatArray


def read_tracks(file: Path) -> dict[int, Track]:
    """Read a file in OpenTraj's format: frame, id, x, z, y, vx, vz, vy. Returns tracks by id.

    Raises:
        TracksError: Naming the file and what is wrong with it.
    """
    try:
        rows = np.loadtxt(file, ndmin=2)
    except (OSError, ValueError) as error:
        raise TracksError(f"{file}: must be a file of tracks, eight numbers a line: {error}") from error
    if rows.shape[1] != 8 or not np.isfinite(rows).all():
        raise TracksError(f"{file}: must have eight finite numbers a line, got {rows.shape[1]} columns")
    tracks = {}
    for identity in np.unique(rows[:, 1]):
        own = rows[rows[:, 1] == identity]
        if (np.diff(own[:, 0]) != FRAMES_A_ROW).any():
            raise TracksError(f"{file}: person {identity:g} must have a row every {FRAMES_A_ROW} frames, without gaps")
        tracks[int(identity)] = Track(int((own[0, 0] - rows[0, 0]) // FRAMES_A_ROW), own[:, [2, 4]])
    return tracks


def read_groups(file: Path, tracks: dict[int, Track]) -> IntArray:
    """Read groups: a number for each track, the same for companions; a line of the file is a group."""
    try:
        lines = [[int(each) for each in line.split()] for line in file.read_text().splitlines()]
    except (OSError, ValueError) as error:
        raise TracksError(f"{file}: must be a file of groups, ids a line: {error}") from error
    group = {identity: number for number, identity in enumerate(tracks)}
    for number, members in enumerate(lines):
        group |= {identity: len(tracks) + number for identity in members if identity in group}
    return np.array(list(group.values()))


def walks_of(tracks: dict[int, Track]) -> Walks:
    """Every 4.8 s of every track, the first from its second row on: the first row has no velocity."""
    paths, velocities, exits, others = [], [], [], []
    for identity, track in tracks.items():
        for start in range(1, len(track.places) - HORIZON, HORIZON):
            first = track.first + start
            paths.append(track.places[start : start + HORIZON + 1])
            velocities.append((track.places[start] - track.places[start - 1]) / FRAME_PERIOD)
            exits.append(track.places[-1])
            others.append(_others(tracks, identity, first))
    most = max((len(each) for each in others), default=0)
    padded = np.full((len(others), most, HORIZON + 1, 2), np.nan)
    for row, each in zip(padded, others, strict=True):
        row[: len(each)] = each
    return Walks(np.array(paths), np.array(velocities), np.array(exits), padded)


def _others(tracks: dict[int, Track], identity: int, first: int) -> FloatArray:
    """All others present at some time of the walk that begins in row `first`, (m, HORIZON + 1, 2)."""
    seen = []
    for other, track in tracks.items():
        last = track.first + len(track.places)
        if other != identity and track.first <= first + HORIZON and last > first:
            places = np.full((HORIZON + 1, 2), np.nan)
            begin, end = max(track.first, first), min(last, first + HORIZON + 1)
            places[begin - first : end - first] = track.places[begin - track.first : end - track.first]
            seen.append(places)
    return np.array(seen).reshape(-1, HORIZON + 1, 2)
