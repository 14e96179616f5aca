"""Interactions among people and with objects, at the start and at any time of an episode."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from reward_model.base.arrays import BoolArray, FloatArray, IntArray
from socnav_env.config import TALKING
from socnav_env.layout import Layout

NO_CHANGES: IntArray = np.zeros((0, 4), dtype=np.int64)


class InteractionPairs(NamedTuple):
    """The interactions at one moment; see `Layout`."""

    pairs: IntArray
    relations: tuple[str, ...]


class InteractionHistory(NamedTuple):
    """All interactions of an episode of n steps.

    Attributes:
        pairs: (num_pairs, 2) and relations as in `Layout`, each pair once
        present: (n + 1, num_pairs) whether each pair interacts at each row of the trajectory
    """

    pairs: IntArray
    relations: tuple[str, ...]
    present: BoolArray


def interactions_of(layout: Layout) -> InteractionPairs:
    """The interactions when the world is created."""
    return InteractionPairs(layout.interaction_pairs, layout.interaction_relations)


def changed(interactions: InteractionPairs, pair: list[int], begins: bool) -> InteractionPairs:
    """Interactions after two people, lower index first, have begun or ended to talk."""
    if begins:
        return InteractionPairs(np.vstack([interactions.pairs, pair]), (*interactions.relations, TALKING))
    talks = np.array([relation == TALKING for relation in interactions.relations], dtype=np.bool_)
    kept = ~(talks & (np.sort(interactions.pairs, axis=1) == pair).all(axis=1))
    relations = tuple(relation for relation, keep in zip(interactions.relations, kept, strict=True) if keep)
    return InteractionPairs(interactions.pairs[kept], relations)


def interactions_at(row: int, layout: Layout, changes: IntArray) -> InteractionPairs:
    """The interactions at a row of the trajectory; changes: (num_changes, 4), see `Trajectory`."""
    interactions = interactions_of(layout)
    for _, one, other, begins in changes[changes[:, 0] <= row].tolist():
        interactions = changed(interactions, [one, other], bool(begins))
    return interactions


def history_of(layout: Layout, changes: IntArray, num_rows: int) -> InteractionHistory:
    """The interactions at each of `num_rows` rows of a trajectory; changes: (num_changes, 4), see `Trajectory`."""
    pairs, relations = layout.interaction_pairs.tolist(), list(layout.interaction_relations)
    present = [np.ones(num_rows, dtype=np.bool_) for _ in pairs]
    talks = {tuple(sorted(pair)): index for index, pair in enumerate(pairs) if relations[index] == TALKING}
    for row, one, other, begins in changes.tolist():
        if (one, other) not in talks:
            talks[one, other] = len(pairs)
            pairs.append([one, other])
            relations.append(TALKING)
            present.append(np.zeros(num_rows, dtype=np.bool_))
        present[talks[one, other]][row:] = bool(begins)
    when = np.array(present, dtype=np.bool_).reshape(len(pairs), num_rows).T
    return InteractionHistory(np.array(pairs, dtype=np.int64).reshape(-1, 2), tuple(relations), when)


def standing_groups(layout: Layout) -> list[list[int]]:
    """Groups of people linked by conversations, directly or through others, each in ascending order."""
    return linked_groups(interactions_of(layout))


def linked_groups(interactions: InteractionPairs) -> list[list[int]]:
    """Groups as in `standing_groups`, of given interactions."""
    groups: list[set[int]] = []
    for pair, relation in zip(interactions.pairs.tolist(), interactions.relations, strict=True):
        if relation == TALKING:
            linked = [group for group in groups if not group.isdisjoint(pair)]
            groups = [group for group in groups if group.isdisjoint(pair)]
            groups.append(set(pair).union(*linked))
    return [sorted(group) for group in groups]


def occupied(layout: Layout) -> BoolArray:
    """(num_people,) whether each person interacts with anyone or anything."""
    busy = np.zeros(layout.num_people + layout.num_objects, dtype=np.bool_)
    busy[layout.interaction_pairs.ravel()] = True
    return np.asarray(busy[: layout.num_people])


def talking(layout: Layout) -> BoolArray:
    """(num_people,) whether each person talks with anyone."""
    talks = np.zeros(layout.num_people, dtype=np.bool_)
    talks[[person for group in standing_groups(layout) for person in group]] = True
    return talks


def circles_of(interactions: InteractionPairs, people_poses: FloatArray) -> FloatArray:
    """(num_circles, 3) x, y, radius [m] of the circles in which three or more people talk.

    Args:
        people_poses: (num_people, 2 or more) x, y [m] first
    """
    circles = []
    for group in linked_groups(interactions):
        if len(group) > 2:
            places = people_poses[group, :2]
            middle = places.mean(axis=0)
            offsets = places - middle
            circles.append([*middle, np.hypot(offsets[:, 0], offsets[:, 1]).mean()])
    return np.array(circles, dtype=np.float64).reshape(-1, 3)
