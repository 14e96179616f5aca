"""Search for walking parameters that fit real pedestrians."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import differential_evolution

from benchmarks.realism.crowd_replay import KINDS, Figures, figures_of, social_force_walker, straight_walker
from benchmarks.realism.tracks import Walks
from socnav_env.config import PeopleConfig

SEARCHED = {
    "relaxation_time": (0.2, 2.0),
    "max_turn_rate": (1.0, 6.0),
    "avoidance": (0.0, 6.0),
    "avoidance_range": (0.1, 0.6),
    "velocity_weight": (0.0, 4.0),
    "unseen_weight": (0.0, 1.0),
}
COLLISION_WEIGHT = 0.25  # of collisions against ADE, each as a ratio to the straight walker's
POPULATION = 5  # candidates in a generation for each parameter


def fit(walks: Walks, generations: int, seed: int, report: Callable[[float], None]) -> PeopleConfig:
    """Minimise the loss, a mean over `KINDS`, by differential evolution (Storn & Price 1997).

    Args:
        report: called after each generation with the least loss so far
    """
    straight = [figures_of(walks, straight_walker(walks, kind)) for kind in KINDS]

    def loss(values: Sequence[float]) -> float:
        walker = social_force_walker(_people(values))
        found = [figures_of(walks, walker(walks, kind)) for kind in KINDS]
        return float(np.mean([_loss(one, other) for one, other in zip(found, straight, strict=True)]))

    result = differential_evolution(
        loss,
        list(SEARCHED.values()),
        maxiter=generations,
        popsize=POPULATION,
        rng=seed,
        polish=False,
        tol=0.0,
        callback=lambda intermediate_result: report(float(intermediate_result.fun)),
    )
    return _people(result.x)


def _loss(figures: Figures, straight: Figures) -> float:
    return figures.ade / straight.ade + COLLISION_WEIGHT * figures.collisions / straight.collisions


def _people(values: Sequence[float]) -> PeopleConfig:
    names = dict(zip(SEARCHED, (float(value) for value in values), strict=True))
    return dataclasses.replace(PeopleConfig(), **names)
