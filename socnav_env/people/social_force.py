"""How people walk by social force, as functions of arrays; what keeps groups together is in `groups`.

Driving force: Helbing & Molnar, Social force model for pedestrian dynamics, 1995. Avoiding others: Moussaid et
al., Experimental study of the behavioural mechanisms underlying self-organization in human crowds, 2009; it makes
people step aside rather than push back. Field of view: Helbing & Molnar 1995. Walls:
Moussaid et al., The walking behaviour of pedestrian social groups and its impact on crowd dynamics, 2010.
"""

from __future__ import annotations

import math

from reward_model.base.angles import wrap_angle
from reward_model.base.arrays import FloatArray, IntArray
from reward_model.base.numba import njit
from socnav_env.config import MAX_HASTE
from socnav_env.geometry.distances import closest_on_box, closest_on_wall, is_free, line_is_free
from socnav_env.people.groups import group_force, middle_of_group, place_in_group
from socnav_env.people.walkers import Habits, Surroundings, Walkers

# Moussaid et al. 2009, table 1
ANGULAR_RANGE = 3.0  # n'; of slowing down
ANGULAR_RANGE_ASIDE = 2.0  # n; of stepping aside
SIDE_BIAS = 0.005  # rad/m; makes two who meet head on step to the same hand

ARRIVED = 0.2  # m from the target, or less: the walker waits there for the next one
SLOW_DOWN = 0.5  # m from the target at which walkers slow down
TURN_RATE = 3.0  # 1/s at which a heading closes in on the direction wanted
STUCK_SPEED = 0.1  # m/s; slower than that is standing still
STOPPED_SPEED = 0.01  # m/s; below it those who want to stand do


@njit
def _avoid(
    dx: float, dy: float, closing_x: float, closing_y: float, strength: float, habits: Habits
) -> tuple[float, float]:
    """Acceleration away from another at (dx, dy), whom one nears with velocity `closing` [m/s^2]."""
    distance = max(math.hypot(dx, dy), 1e-6)
    heading_x = habits.velocity_weight * closing_x + dx / distance
    heading_y = habits.velocity_weight * closing_y + dy / distance
    size = math.hypot(heading_x, heading_y)
    if size < 1e-6:
        return 0.0, 0.0
    unit_x, unit_y = heading_x / size, heading_y / size
    reach = habits.avoidance_range * size
    angle = math.atan2(unit_x * dy - unit_y * dx, unit_x * dx + unit_y * dy) + SIDE_BIAS * reach
    back = -strength * math.exp(-distance / reach - (ANGULAR_RANGE * reach * angle) ** 2)
    aside = -strength * math.exp(-distance / reach - (ANGULAR_RANGE_ASIDE * reach * angle) ** 2)
    aside = math.copysign(aside, -angle)
    return back * unit_x - aside * unit_y, back * unit_y + aside * unit_x


@njit
def _weight_in_view(dx: float, dy: float, heading: float, habits: Habits) -> float:
    """How much someone at (dx, dy) counts: all, or less where they are out of view."""
    if habits.unseen_weight == 1.0:
        return 1.0
    angle = wrap_angle(math.atan2(dy, dx) - heading)
    return 1.0 if abs(angle) <= habits.half_view else habits.unseen_weight


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
    x, y, heading, vx, vy, _ = bodies[walker]
    force_x, force_y = 0.0, 0.0
    for other in range(len(bodies)):
        is_robot = other == len(bodies) - 1
        if other == walker or (not is_robot and group[other] == group[walker]):
            continue
        strength = habits.avoidance * (notice if is_robot else 1.0)
        to, closing = bodies[other, :2], bodies[other, 3:5]
        strength *= _weight_in_view(to[0] - x, to[1] - y, heading, habits)
        ax, ay = _avoid(to[0] - x, to[1] - y, vx - closing[0], vy - closing[1], strength, habits)
        force_x, force_y = force_x + ax, force_y + ay
    for disc in around.discs:
        strength = habits.avoidance * _weight_in_view(disc[0] - x, disc[1] - y, heading, habits)
        ax, ay = _avoid(disc[0] - x, disc[1] - y, vx, vy, strength, habits)
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
def robot_is_near(walker: int, bodies: FloatArray, group: IntArray, stop_distance: float) -> bool:
    """Whether the robot is within the stop distance of anyone in the walker's group."""
    robot = bodies[len(bodies) - 1]
    for other in range(len(group)):
        if group[other] == group[walker]:
            distance = math.hypot(bodies[other, 0] - robot[0], bodies[other, 1] - robot[1])
            if distance < stop_distance:
                return True
    return False


@njit
def way_to_target(walker: int, bodies: FloatArray, walkers: Walkers) -> tuple[float, float, float]:
    """Direction from the middle of a walker's group to the target, and the desired speed [m/s], 0 where they are."""
    middle_x, middle_y, _ = middle_of_group(walker, bodies, walkers.group)
    way_x, way_y = walkers.target[walker, 0] - middle_x, walkers.target[walker, 1] - middle_y
    distance = math.hypot(way_x, way_y)
    if distance < ARRIVED:
        return 0.0, 0.0, 0.0
    return way_x / distance, way_y / distance, walkers.speed[walker] * min(1.0, distance / SLOW_DOWN)


@njit
def way_to_formation(
    walker: int, bodies: FloatArray, walkers: Walkers, way_x: float, way_y: float, habits: Habits
) -> tuple[float, float]:
    """Velocity towards a walker's place beside the others of the group [m/s]; zero for those on their own."""
    if middle_of_group(walker, bodies, walkers.group)[2] == 1:
        return 0.0, 0.0
    off_x, off_y = place_in_group(walker, bodies, walkers.group, walkers.spacing[walker], way_x, way_y)
    return habits.group_formation * off_x, habits.group_formation * off_y


@njit
def _wanted_velocity(
    walker: int, bodies: FloatArray, walkers: Walkers, notice: float, around: Surroundings, habits: Habits
) -> tuple[float, float]:
    """Velocity a walker would take up at once if they could [m/s]; zero at the target."""
    way_x, way_y, speed = way_to_target(walker, bodies, walkers)
    if speed == 0.0:
        return 0.0, 0.0
    force_x, force_y = _social_force(walker, bodies, walkers.group, notice, around, habits)
    group_x, group_y = group_force(walker, bodies, walkers.group, walkers.spacing[walker], habits)
    formation_x, formation_y = way_to_formation(walker, bodies, walkers, way_x, way_y, habits)
    wanted_x = speed * way_x + habits.relaxation_time * (force_x + group_x) + formation_x
    wanted_y = speed * way_y + habits.relaxation_time * (force_y + group_y) + formation_y
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

    Args:
        step: [s]
        bodies: (num_walkers + 1, 6) x, y, heading, vx, vy, turn rate of the walkers and, in the last row, the robot
        stop_distance: [m] between centres, within which walkers stop for the robot
        notice: 0..1, how strongly walkers avoid the robot
        velocities: (num_walkers + 1, 3) vx, vy, turn rate; the walkers' rows are written
    """
    for walker in range(len(bodies) - 1):
        vx, vy, turn_rate = next_velocity(walker, step, bodies, walkers, stop_distance, notice, around, habits)
        velocities[walker, 0], velocities[walker, 1], velocities[walker, 2] = vx, vy, turn_rate


@njit
def next_velocity(
    walker: int,
    step: float,
    bodies: FloatArray,
    walkers: Walkers,
    stop_distance: float,
    notice: float,
    around: Surroundings,
    habits: Habits,
) -> tuple[float, float, float]:
    """One walker's part of `walk`: vx, vy [m/s] and turn rate [rad/s] of the next physics step."""
    wanted_x, wanted_y = 0.0, 0.0
    walkers.time_left[walker] -= step
    if not robot_is_near(walker, bodies, walkers.group, stop_distance):
        wanted_x, wanted_y = _wanted_velocity(walker, bodies, walkers, notice, around, habits)
    wanted_x, wanted_y, turn_rate = turn_towards(walker, step, bodies, walkers, wanted_x, wanted_y, habits)
    vx, vy = bodies[walker, 3], bodies[walker, 4]
    blend = min(1.0, step / habits.relaxation_time)
    change_x, change_y = blend * (wanted_x - vx), blend * (wanted_y - vy)
    excess = math.hypot(change_x, change_y) / (habits.max_acceleration * step)
    if excess > 1.0:
        change_x, change_y = change_x / excess, change_y / excess
    vx, vy = vx + change_x, vy + change_y
    if wanted_x == 0.0 and wanted_y == 0.0 and math.hypot(vx, vy) < STOPPED_SPEED:
        return 0.0, 0.0, turn_rate
    return vx, vy, turn_rate


@njit
def turn_towards(
    walker: int,
    step: float,
    bodies: FloatArray,
    walkers: Walkers,
    wanted_x: float,
    wanted_y: float,
    habits: Habits,
) -> tuple[float, float, float]:
    """Turn a walker to the velocity they want, and keep count of how long they are blocked.

    Returns:
        The velocity wanted, less where they have yet to turn [m/s], and the turn rate [rad/s].
    """
    heading, vx, vy = bodies[walker, 2], bodies[walker, 3], bodies[walker, 4]
    if wanted_x != 0.0 or wanted_y != 0.0:
        turn, turn_rate = _turn_to(math.atan2(wanted_y, wanted_x), heading, habits)
        ahead = max(0.0, math.cos(turn))
        stuck = ahead > 0.5 and math.hypot(vx, vy) < STUCK_SPEED
        walkers.blocked[walker] = max(0.0, walkers.blocked[walker] + (step if stuck else -step))
        return wanted_x * ahead, wanted_y * ahead, turn_rate
    if math.isnan(walkers.facing[walker]):
        return 0.0, 0.0, 0.0
    return 0.0, 0.0, _turn_to(walkers.facing[walker], heading, habits)[1]


@njit
def _turn_to(direction: float, heading: float, habits: Habits) -> tuple[float, float]:
    """By how much to turn [rad], and how fast [rad/s]."""
    turn = wrap_angle(direction - heading)
    return turn, min(max(TURN_RATE * turn, -habits.max_turn_rate), habits.max_turn_rate)


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
