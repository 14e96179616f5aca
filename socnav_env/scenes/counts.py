"""Random numbers of people, objects and interactions in a scene."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from socnav_env.config import PopulationConfig


class Counts(NamedTuple):
    """The numbers of people, objects and interactions in a scene.

    Attributes:
        relations: one name for each interaction
        walking_groups, circles: number of people in each
    """

    still: int
    wandering: int
    tables: int
    plants: int
    relations: tuple[str, ...]
    walking_groups: tuple[int, ...]
    circles: tuple[int, ...]


def draw_counts(population: PopulationConfig, rng: np.random.Generator) -> Counts:
    """Draw every count from its range; options that are off by default draw no random number while off."""
    limits = [population.still, population.wandering, population.tables, population.plants]
    limits.append(population.interactions)
    low, high = np.array(limits).T
    still, wandering, tables, plants, interactions = rng.integers(low, high + 1).tolist()
    return Counts(
        still=still,
        wandering=wandering,
        tables=tables,
        plants=plants,
        relations=_draw_relations(population, interactions, rng),
        walking_groups=_draw_sizes(population.walking_groups, population.walking_group_size, rng),
        circles=_draw_sizes(population.circles, population.circle_size, rng),
    )


def _draw_relations(population: PopulationConfig, count: int, rng: np.random.Generator) -> tuple[str, ...]:
    kinds = len(population.relations)
    if population.relation_weights:
        weights = np.array(population.relation_weights, dtype=np.float64)
        drawn = rng.choice(kinds, count, p=weights / weights.sum())
    else:
        drawn = rng.integers(kinds, size=count)
    return tuple(population.relations[kind] for kind in drawn)


def _draw_sizes(count: tuple[int, int], size: tuple[int, int], rng: np.random.Generator) -> tuple[int, ...]:
    """The sizes of a random number of groups."""
    if count[1] == 0:
        return ()
    return tuple(rng.integers(size[0], size[1] + 1, rng.integers(count[0], count[1] + 1)).tolist())
