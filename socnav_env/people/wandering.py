"""Targets of people who wander: random free places, one after the other."""

from __future__ import annotations

import numpy as np

from reward_model.base.arrays import BoolArray, FloatArray
from socnav_env.config import EnvConfig
from socnav_env.layout import Layout
from socnav_env.people.social_force import first_in_sight
from socnav_env.people.walkers import Surroundings, Walkers

TARGET_CANDIDATES = 32
TARGET_SPREAD = 0.25  # relative variation of the interval between targets
MIN_WALK = 1.0  # m, minimum distance to a new target
MOST_MARGIN = 0.5  # m, limit of a group's half width in the clearance of targets; a wider group squeezes through


def pick_targets(
    needed: BoolArray,
    walkers: Walkers,
    places: FloatArray,
    layout: Layout,
    around: Surroundings,
    config: EnvConfig,
    rng: np.random.Generator,
) -> None:
    """Give a new target to each group in need of one; a group that finds none waits and tries again.

    Args:
        needed: (num_walkers,)
        places: (num_walkers, 2) [m] their positions
        around: obstacles, which targets and the ways to them must avoid
    """
    people = config.people
    for group in np.unique(walkers.group[needed]):
        members = walkers.group == group
        spread = min(walkers.spacing[members][0] * (members.sum() - 1) / 2, MOST_MARGIN)
        target = _sample_target(places[members].mean(axis=0), people.clearance + spread, layout, around, config, rng)
        walkers.blocked[members] = 0.0
        if target is None:
            walkers.time_left[members] = people.patience
            continue
        walkers.target[members] = target
        interval = people.target_interval * rng.uniform(1 - TARGET_SPREAD, 1 + TARGET_SPREAD)
        walkers.time_left[members] = interval


def _sample_target(
    start: FloatArray,
    margin: float,
    layout: Layout,
    around: Surroundings,
    config: EnvConfig,
    rng: np.random.Generator,
) -> FloatArray | None:
    """A free place in sight of `start` and away from the goal; None if none was found."""
    lower, upper = layout.room.corners.min(axis=0), layout.room.corners.max(axis=0)
    places = rng.uniform(lower, upper, (TARGET_CANDIDATES, 2))
    far = np.hypot(*(places - start).T) >= MIN_WALK
    off_goal = np.hypot(*(places - layout.goal).T) >= config.people.clearance + config.robot.radius
    places = places[far & off_goal]
    index = first_in_sight(start, places, margin, *around)
    return places[index] if index >= 0 else None
