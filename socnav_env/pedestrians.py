"""How people walk, as functions of arrays: social force, groups side by side, standing, new targets.

Driving force: Helbing & Molnar, Social force model for pedestrian dynamics, 1995. Avoiding others: Moussaid et
al., Experimental study of the behavioural mechanisms underlying self-organization in human crowds, 2009; it makes
people step aside rather than push back. Walls: Moussaid et al., The walking behaviour of pedestrian social groups
and its impact on crowd dynamics, 2010, whose force that keeps a group together is replaced here by places side by
side, since theirs leaves two who walk one behind the other as they are.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from reward_model.jit import njit
from socnav_env.config import MAX_HASTE, PeopleConfig
from socnav_env.geometry import closest_on_box, closest_on_wall, is_free, line_is_free
from socnav_env.layout import BoolArray, FloatArray, IntArray

# Moussaid et al. 2009, table 1
VELOCITY_WEIGHT = 2.0  # of the relative velocity against the direction to the other
INTERACTION_RANGE = 0.35  # gamma
ANGULAR_RANGE = 3.0  # n'; of slowing down
ANGULAR_RANGE_ASIDE = 2.0  # n; of stepping aside
SIDE_BIAS = 0.005  # rad/m; makes two who meet head on step to the same hand

ARRIVED = 0.2  # m from the target, or less: the walker waits there for the next one
SLOW_DOWN = 0.5  # m from the target at which walkers slow down
FORMATION_RATE = 1.0  # 1/s at which members of a group close in on their places
TURN_RATE = 3.0  # 1/s at which a heading closes in on the direction wanted
STUCK_SPEED = 0.1  # m/s; slower than that is standing still
STOPPED_SPEED = 0.01  # m/s; below it those who want to stand do


class Surroundings(NamedTuple):
    """What does not move, as `geometry` has it."""

    walls: FloatArray
    discs: FloatArray  # people who stand
    boxes: FloatArray


class Walkers(NamedTuple):
    """The people who walk; each array has a row for each of them.

    speed: [m/s] desired, in a group the slowest member's
    group: walkers with the same number walk together; everyone has one
    spacing: [m] between neighbours in the group
    target: (num_walkers, 2) where to, in a group the same for all
    time_left: [s] until the next target is picked
    blocked: [s] without getting on
    """

    speed: FloatArray
    group: IntArray
    spacing: FloatArray
    target: FloatArray
    time_left: FloatArray
    blocked: FloatArray


class Habits(NamedTuple):
    """The numbers of `PeopleConfig` that the kernels need."""

    radius: float
    relaxation_time: float
    max_turn_rate: float
    avoidance: float
    wall_repulsion: float
    wall_range: float


def habits_of(people: PeopleConfig) -> Habits:
    """The part of the configuration that is needed at every physics step."""
    return Habits(*(getattr(people, name) for name in Habits._fields))


@njit
def _avoid(dx: float, dy: float, closing_x: float, closing_y: float, strength: float) -> tuple[float, float]:
    """Acceleration away from another at (dx, dy), whom one nears with velocity `closing` [m/s^2]."""
    distance = max(math.hypot(dx, dy), 1e-6)
    heading_x = VELOCITY_WEIGHT * closing_x + dx / distance
    heading_y = VELOCITY_WEIGHT * closing_y + dy / distance
    size = math.hypot(heading_x, heading_y)
    if size < 1e-6:
        return 0.0, 0.0
    unit_x, unit_y = heading_x / size, heading_y / size
    reach = INTERACTION_RANGE * size
    angle = math.atan2(unit_x * dy - unit_y * dx, unit_x * dx + unit_y * dy) + SIDE_BIAS * reach
    back = -strength * math.exp(-distance / reach - (ANGULAR_RANGE * reach * angle) ** 2)
    aside = -strength * math.exp(-distance / reach - (ANGULAR_RANGE_ASIDE * reach * angle) ** 2)
    aside = math.copysign(aside, -angle)
    return back * unit_x - aside * unit_y, back * unit_y + aside * unit_x


@njit
def _keep_off(dx: float, dy: float, habits: Habits) -> tuple[float, float]:
    """Acceleration away from the nearest point of a wall or an object at (dx, dy) [m/s^2]."""
    distance = max(math.hypot(dx, dy), 1e-6)
    push = habits.wall_repulsion * math.exp((habits.radius - distance) / habits.wall_range)
    return -push * dx / distance, -push * dy / distance


@njit
def _social_force(
    walker: int, bodies: FloatArray, group: IntArray, notice: float, around: Surroundings, habits: Habits
) -> tuple[float, float]:
    """Acceleration of a walker because of everyone and everything around [m/s^2]."""
    x, y, _, vx, vy, _ = bodies[walker]
    force_x, force_y = 0.0, 0.0
    for other in range(len(bodies)):
        is_robot = other == len(bodies) - 1
        if other == walker or (not is_robot and group[other] == group[walker]):
            continue
        strength = habits.avoidance * (notice if is_robot else 1.0)
        to, closing = bodies[other, :2], bodies[other, 3:5]
        ax, ay = _avoid(to[0] - x, to[1] - y, vx - closing[0], vy - closing[1], strength)
        force_x, force_y = force_x + ax, force_y + ay
    for disc in around.discs:
        ax, ay = _avoid(disc[0] - x, disc[1] - y, vx, vy, habits.avoidance)
        force_x, force_y = force_x + ax, force_y + ay
    for box in around.boxes:
        near_x, near_y = closest_on_box(x, y, box)
        ax, ay = _keep_off(near_x - x, near_y - y, habits)
        force_x, force_y = force_x + ax, force_y + ay
    for wall in around.walls:
        near_x, near_y = closest_on_wall(x, y, wall)
        ax, ay = _keep_off(near_x - x, near_y - y, habits)
        force_x, force_y = force_x + ax, force_y + ay
    return force_x, force_y


@njit
def _middle_of_group(walker: int, bodies: FloatArray, group: IntArray) -> tuple[float, float, int]:
    """Where the middle of a walker's group is, and how many belong to it."""
    x, y, count = 0.0, 0.0, 0
    for other in range(len(group)):
        if group[other] == group[walker]:
            x, y, count = x + bodies[other, 0], y + bodies[other, 1], count + 1
    return x / count, y / count, count


@njit
def _place_in_group(
    walker: int, bodies: FloatArray, group: IntArray, spacing: float, way_x: float, way_y: float
) -> tuple[float, float]:
    """How far a walker is from their place beside the others of the group, who walk towards (way_x, way_y)."""
    middle_x, middle_y, count = _middle_of_group(walker, bodies, group)
    own = way_x * bodies[walker, 1] - way_y * bodies[walker, 0]
    rank = 0
    for other in range(len(group)):
        if other != walker and group[other] == group[walker]:
            beside = way_x * bodies[other, 1] - way_y * bodies[other, 0]
            rank += beside < own or (beside == own and other < walker)
    offset = (rank - (count - 1) / 2) * spacing
    return middle_x - way_y * offset - bodies[walker, 0], middle_y + way_x * offset - bodies[walker, 1]


@njit
def _robot_is_near(walker: int, bodies: FloatArray, group: IntArray, stop_distance: float) -> bool:
    """Whether the robot is within the stop distance of anyone in the walker's group."""
    robot = bodies[len(bodies) - 1]
    for other in range(len(group)):
        if group[other] == group[walker]:
            distance = math.hypot(bodies[other, 0] - robot[0], bodies[other, 1] - robot[1])
            if distance < stop_distance:
                return True
    return False


@njit
def _wanted_velocity(
    walker: int, bodies: FloatArray, walkers: Walkers, notice: float, around: Surroundings, habits: Habits
) -> tuple[float, float]:
    """Velocity a walker would take up at once if they could [m/s]; zero at the target."""
    middle_x, middle_y, count = _middle_of_group(walker, bodies, walkers.group)
    way_x, way_y = walkers.target[walker, 0] - middle_x, walkers.target[walker, 1] - middle_y
    distance = math.hypot(way_x, way_y)
    if distance < ARRIVED:
        return 0.0, 0.0
    way_x, way_y = way_x / distance, way_y / distance
    speed = walkers.speed[walker] * min(1.0, distance / SLOW_DOWN)
    force_x, force_y = _social_force(walker, bodies, walkers.group, notice, around, habits)
    wanted_x = speed * way_x + habits.relaxation_time * force_x
    wanted_y = speed * way_y + habits.relaxation_time * force_y
    if count > 1:
        spacing = walkers.spacing[walker]
        off_x, off_y = _place_in_group(walker, bodies, walkers.group, spacing, way_x, way_y)
        wanted_x, wanted_y = wanted_x + FORMATION_RATE * off_x, wanted_y + FORMATION_RATE * off_y
    haste = math.hypot(wanted_x, wanted_y) / (MAX_HASTE * walkers.speed[walker])
    if haste > 1.0:
        return wanted_x / haste, wanted_y / haste
    return wanted_x, wanted_y


@njit
def walk(
    step: float,
    bodies: FloatArray,
    walkers: Walkers,
    stop_distance: float,
    notice: float,
    around: Surroundings,
    habits: Habits,
    velocities: FloatArray,
) -> None:
    """Find the velocities of the next physics step; keep count of who waits and who is blocked.

    step: [s]
    bodies: (num_walkers + 1, 6) x, y, heading, vx, vy, turn rate of the walkers and, in the last row, the robot
    stop_distance: [m] between centres, within which walkers stop for the robot
    notice: 0..1, how strongly walkers avoid the robot
    velocities: (num_walkers + 1, 3) vx, vy, turn rate; the walkers' rows are written
    """
    blend = min(1.0, step / habits.relaxation_time)
    for walker in range(len(bodies) - 1):
        heading, vx, vy = bodies[walker, 2], bodies[walker, 3], bodies[walker, 4]
        walkers.time_left[walker] -= step
        wanted_x, wanted_y, turn_rate = 0.0, 0.0, 0.0
        if not _robot_is_near(walker, bodies, walkers.group, stop_distance):
            wanted_x, wanted_y = _wanted_velocity(walker, bodies, walkers, notice, around, habits)
        if wanted_x != 0.0 or wanted_y != 0.0:
            turn = math.atan2(wanted_y, wanted_x) - heading
            turn -= 2 * math.pi * math.floor(turn / (2 * math.pi) + 0.5)
            turn_rate = min(max(TURN_RATE * turn, -habits.max_turn_rate), habits.max_turn_rate)
            ahead = max(0.0, math.cos(turn))
            wanted_x, wanted_y = wanted_x * ahead, wanted_y * ahead
            stuck = ahead > 0.5 and math.hypot(vx, vy) < STUCK_SPEED
            walkers.blocked[walker] = max(0.0, walkers.blocked[walker] + (step if stuck else -step))
        vx, vy = vx + blend * (wanted_x - vx), vy + blend * (wanted_y - vy)
        if wanted_x == 0.0 and wanted_y == 0.0 and math.hypot(vx, vy) < STOPPED_SPEED:
            vx, vy = 0.0, 0.0
        velocities[walker, 0], velocities[walker, 1], velocities[walker, 2] = vx, vy, turn_rate


@njit
def first_in_sight(
    start: FloatArray, places: FloatArray, margin: float, walls: FloatArray, discs: FloatArray, boxes: FloatArray
) -> int:
    """Index of the first of `places` (n, 2) that is free and that one can walk to straight; -1 if there is none."""
    for index in range(len(places)):
        x, y = places[index]
        if is_free(x, y, margin, walls, discs, boxes) and line_is_free(
            start, places[index], margin, walls, discs, boxes
        ):
            return index
    return -1


@njit
def anyone_needs_target(time_left: FloatArray, blocked: FloatArray, patience: float) -> bool:
    """Whether `in_need_of_target` would name anyone; asked every period, and most often nobody does."""
    return len(time_left) > 0 and (time_left.min() <= 0.0 or blocked.max() > patience)


def in_need_of_target(walkers: Walkers, patience: float) -> BoolArray:
    """Which walkers have had their target for long enough, or are blocked on the way. Returns (num_walkers,)."""
    return (walkers.time_left <= 0.0) | (walkers.blocked > patience)


def sample_speeds(people: PeopleConfig, count: int, rng: np.random.Generator) -> FloatArray:
    """Desired speeds of `count` people [m/s]."""
    return np.clip(rng.normal(people.speed, people.speed_deviation, count), *people.speed_limits)


def walkers_of(poses: FloatArray, groups: IntArray, people: PeopleConfig, rng: np.random.Generator) -> Walkers:
    """Walkers at the beginning, in need of a target.

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
    return Walkers(speed, group, spacing, poses[:, :2].copy(), np.zeros(count), np.zeros(count))
