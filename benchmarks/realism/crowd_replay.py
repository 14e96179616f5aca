"""Recorded crowds in which one pedestrian at a time is replaced by a simulated walker."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from benchmarks.realism.tracks import FRAME_PERIOD, HORIZON, Walks
from reward_model.base.arrays import FloatArray
from reward_model.base.numba import njit
from socnav_env.config import PeopleConfig
from socnav_env.people.social_force import next_velocity
from socnav_env.people.walkers import Habits, Surroundings, Walkers, habits_of

KINDS = ("exit", "place", "appointment")  # kinds of final points; see `benchmarks.realism`
STEPS_A_ROW = 8  # of simulation between two rows of a track
STEP = FRAME_PERIOD / STEPS_A_ROW  # s
STEPS = HORIZON * STEPS_A_ROW
TOUCH = 0.5  # m between the centres of two bodies that touch
LEAST_SPEED = 0.05  # m/s; a person who stands at the start gets it, so that directions are defined

Walker = Callable[[Walks, str], FloatArray]  # from walks and a kind to paths (n, STEPS + 1, 2)


class Figures(NamedTuple):
    """Means over all walks: errors [m] and share with a collision."""

    ade: float
    fde: float
    collisions: float


def figures_of(walks: Walks, paths: FloatArray) -> Figures:
    """Errors of paths (n, STEPS + 1, 2) against the real ones, and their collisions with the others."""
    errors = np.linalg.norm(paths[:, STEPS_A_ROW::STEPS_A_ROW] - walks.paths[:, 1:], axis=2)
    return Figures(float(errors.mean()), float(errors[:, -1].mean()), float(touches(paths, walks.others).mean()))


def real_walker(walks: Walks) -> FloatArray:
    """The paths as recorded, straight from row to row."""
    return between_rows(walks.paths)


def straight_walker(walks: Walks, kind: str) -> FloatArray:
    """Paths straight to the final point at one speed, and no further."""
    starts, final = walks.paths[:, 0], final_points(walks, kind)
    way = final - starts
    distances = np.linalg.norm(way, axis=1)
    speeds = np.linalg.norm(walks.velocities, axis=1)
    if kind == "appointment":
        speeds = distances / (HORIZON * FRAME_PERIOD)
    gone = np.minimum(speeds[:, None] * STEP * np.arange(STEPS + 1), distances[:, None])
    directions = way / np.maximum(distances, 1e-9)[:, None]
    return np.asarray(starts[:, None] + gone[..., None] * directions[:, None])


def social_force_walker(people: PeopleConfig) -> Walker:
    """A walker as in the environment. Its desired speed is that of the start or, by appointment, arrives on time."""
    habits = habits_of(people)
    return lambda walks, kind: _simulate_each(
        walks.paths[:, 0], walks.velocities, final_points(walks, kind), kind == "appointment", walks.others, habits
    )


def final_points(walks: Walks, kind: str) -> FloatArray:
    """The final points of walks, (n, 2)."""
    return walks.exits if kind == "exit" else walks.paths[:, -1]


def between_rows(rows: FloatArray) -> FloatArray:
    """Rows (..., HORIZON + 1, 2) to steps (..., STEPS + 1, 2), by linear interpolation."""
    share = (np.arange(STEPS) % STEPS_A_ROW / STEPS_A_ROW)[:, None]
    before = np.repeat(rows[..., :-1, :], STEPS_A_ROW, axis=-2)
    after = np.repeat(rows[..., 1:, :], STEPS_A_ROW, axis=-2)
    return np.concatenate([before + share * (after - before), rows[..., -1:, :]], axis=-2)


@njit
def touches(paths: FloatArray, others: FloatArray) -> FloatArray:
    """1 for paths (n, STEPS + 1, 2) that come closer than `TOUCH` to one of others (n, m, HORIZON + 1, 2), else 0."""
    touched = np.zeros(len(paths))
    for walk in range(len(paths)):
        for step in range(STEPS + 1):
            for other in range(others.shape[1]):
                x, y, _, _ = _other_at(others[walk, other], step)
                # An absent person is NaN, which is not closer.
                if np.hypot(paths[walk, step, 0] - x, paths[walk, step, 1] - y) < TOUCH:
                    touched[walk] = 1.0
    return touched


@njit
def _other_at(rows: FloatArray, step: int) -> tuple[float, float, float, float]:
    """Place and velocity of a person with rows (HORIZON + 1, 2), at a step of the simulation."""
    row = min(step // STEPS_A_ROW, HORIZON - 1)
    time = step * STEP - row * FRAME_PERIOD
    vx, vy = (rows[row + 1, 0] - rows[row, 0]) / FRAME_PERIOD, (rows[row + 1, 1] - rows[row, 1]) / FRAME_PERIOD
    return rows[row, 0] + time * vx, rows[row, 1] + time * vy, vx, vy


@njit
def _simulate_each(
    starts: FloatArray, velocities: FloatArray, finals: FloatArray, in_time: bool, others: FloatArray, habits: Habits
) -> FloatArray:
    """Simulate every walk by social force. Returns (n, STEPS + 1, 2)."""
    paths = np.empty((len(starts), STEPS + 1, 2))
    for walk in range(len(starts)):
        _simulate(starts[walk], velocities[walk], finals[walk], in_time, others[walk], habits, paths[walk])
    return paths


@njit
def _simulate(
    start: FloatArray,
    velocity: FloatArray,
    final: FloatArray,
    in_time: bool,
    others: FloatArray,
    habits: Habits,
    path: FloatArray,
) -> None:
    """Write the path (STEPS + 1, 2) of a person who walks from `start` to `final`, all (2,), among others."""
    most = len(others) + 1
    bodies, walkers = np.zeros((most + 1, 6)), _strangers(most)
    around = Surroundings(np.empty((0, 4)), np.empty((0, 3)), np.empty((0, 6)))
    bodies[0, :2], bodies[0, 3:5] = start, velocity
    ahead = velocity if np.hypot(velocity[0], velocity[1]) > LEAST_SPEED else final - start
    bodies[0, 2] = np.arctan2(ahead[1], ahead[0])
    walkers.target[0] = final
    walkers.speed[0] = max(np.hypot(velocity[0], velocity[1]), LEAST_SPEED)
    path[0] = start
    for step in range(STEPS):
        count = _place_others(others, step, bodies)
        if in_time:
            distance = np.hypot(final[0] - bodies[0, 0], final[1] - bodies[0, 1])
            walkers.speed[0] = max(distance / ((STEPS - step) * STEP), LEAST_SPEED)
        # The last row is the robot's, which nobody notices.
        rows, own = bodies[: count + 2], _first(walkers, count + 1)
        vx, vy, turn_rate = next_velocity(0, STEP, rows, own, 0.0, 0.0, around, habits)
        bodies[0, 0], bodies[0, 1] = bodies[0, 0] + STEP * vx, bodies[0, 1] + STEP * vy
        bodies[0, 2], bodies[0, 3], bodies[0, 4] = bodies[0, 2] + STEP * turn_rate, vx, vy
        path[step + 1] = bodies[0, :2]


@njit
def _place_others(others: FloatArray, step: int, bodies: FloatArray) -> int:
    """Write the people present into `bodies` from row 1 on, and return their number."""
    count = 0
    for other in others:
        x, y, vx, vy = _other_at(other, step)
        if not np.isnan(x):
            count += 1
            bodies[count, 0], bodies[count, 1], bodies[count, 3], bodies[count, 4] = x, y, vx, vy
    return count


@njit
def _strangers(count: int) -> Walkers:
    return Walkers(
        np.ones(count),
        np.arange(count),
        np.zeros(count),
        np.zeros((count, 2)),
        np.zeros(count),
        np.zeros(count),
        np.full(count, np.nan),
    )


@njit
def _first(walkers: Walkers, count: int) -> Walkers:
    return Walkers(
        walkers.speed[:count],
        walkers.group[:count],
        walkers.spacing[:count],
        walkers.target[:count],
        walkers.time_left[:count],
        walkers.blocked[:count],
        walkers.facing[:count],
    )
