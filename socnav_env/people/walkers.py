"""The people who walk, and the configuration values that the kernels need, as plain arrays and numbers."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from reward_model.base.arrays import BoolArray, FloatArray, IntArray
from socnav_env.config import PeopleConfig


class Surroundings(NamedTuple):
    """Static obstacles, in the arrays that `geometry` takes."""

    walls: FloatArray
    discs: FloatArray  # standing people
    boxes: FloatArray


class Walkers(NamedTuple):
    """The people who walk; each array has one row per walker.

    Attributes:
        speed: [m/s] desired speed; in a group that of the slowest member
        group: walkers with the same number walk together; every walker has a number
        spacing: [m] between neighbours in the group
        target: (num_walkers, 2) [m] target position, the same for all members of a group
        time_left: [s] until the next target is picked
        blocked: [s] time without progress
        facing: [rad] heading that a standing walker turns to; NaN: none
    """

    speed: FloatArray
    group: IntArray
    spacing: FloatArray
    target: FloatArray
    time_left: FloatArray
    blocked: FloatArray
    facing: FloatArray


class Habits(NamedTuple):
    """The values of `PeopleConfig` that the kernels need.

    Those that begin with `group_` are values of `GroupConfig`.

    Attributes:
        half_view: [rad] of the field of view to each side
    """

    radius: float
    relaxation_time: float
    max_acceleration: float
    max_turn_rate: float
    avoidance: float
    avoidance_range: float
    velocity_weight: float
    half_view: float
    unseen_weight: float
    wall_repulsion: float
    wall_range: float
    group_formation: float
    group_gaze: float
    group_cohesion: float
    group_repulsion: float


def habits_of(people: PeopleConfig) -> Habits:
    """The configuration values needed at every physics step."""
    group = people.group
    return Habits(
        radius=float(people.radius),
        relaxation_time=float(people.relaxation_time),
        max_acceleration=math.inf if people.max_acceleration is None else float(people.max_acceleration),
        max_turn_rate=float(people.max_turn_rate),
        avoidance=float(people.avoidance),
        avoidance_range=float(people.avoidance_range),
        velocity_weight=float(people.velocity_weight),
        half_view=people.view_angle / 2,
        unseen_weight=float(people.unseen_weight),
        wall_repulsion=float(people.wall_repulsion),
        wall_range=float(people.wall_range),
        group_formation=float(group.formation),
        group_gaze=float(group.gaze),
        group_cohesion=float(group.cohesion),
        group_repulsion=float(group.repulsion),
    )


def in_need_of_target(walkers: Walkers, patience: float) -> BoolArray:
    """Whether each walker has had its target for long enough, or is blocked. Returns (num_walkers,)."""
    return (walkers.time_left <= 0.0) | (walkers.blocked > patience)


def sample_speeds(people: PeopleConfig, count: int, rng: np.random.Generator) -> FloatArray:
    """Desired speeds of `count` people [m/s]."""
    return np.clip(rng.normal(people.speed, people.speed_deviation, count), *people.speed_limits)


def walkers_of(poses: FloatArray, groups: IntArray, people: PeopleConfig, rng: np.random.Generator) -> Walkers:
    """The walkers at the start of an episode, which need a target.

    Args:
        poses: (num_walkers, 3)
        groups: (num_walkers,) people with the same number walk together, as far apart as they are now; -1: alone
    """
    count, group = len(groups), groups.copy()
    alone = group < 0
    group[alone] = group.max(initial=-1) + 1 + np.arange(alone.sum())
    speed, spacing = sample_speeds(people, count, rng), np.zeros(count)
    for number in np.unique(groups[~alone]):
        members = np.flatnonzero(group == number)
        places = poses[members, :2]
        speed[members] = speed[members].min()
        extent = np.hypot(*(places[:, None] - places).transpose(2, 0, 1)).max()
        spacing[members] = extent / max(len(members) - 1, 1)
    return Walkers(speed, group, spacing, poses[:, :2].copy(), np.zeros(count), np.zeros(count), np.full(count, np.nan))
