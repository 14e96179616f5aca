"""Kernels that keep walking groups together.

Places side by side are this project's own: under forces alone, two people who walk one behind the other stay so.
The forces are those of Moussaid et al., The walking behaviour of pedestrian social groups and its impact on crowd
dynamics, 2010.
"""

from __future__ import annotations

import math

from reward_model.base.arrays import FloatArray, IntArray
from reward_model.base.numba import njit
from socnav_env.people.walkers import Habits

HEAD_TURN_FREE = math.pi / 2  # rad to each side in view without slowing down (Moussaid et al. 2010)
COHESION_REACH = 0.5  # m of distance to the group's centre accepted for each companion (Moussaid et al. 2010)


@njit
def middle_of_group(walker: int, bodies: FloatArray, group: IntArray) -> tuple[float, float, int]:
    """The centre x, y [m] of a walker's group, and the number of its members."""
    x, y, count = 0.0, 0.0, 0
    for other in range(len(group)):
        if group[other] == group[walker]:
            x, y, count = x + bodies[other, 0], y + bodies[other, 1], count + 1
    return x / count, y / count, count


@njit
def place_in_group(
    walker: int, bodies: FloatArray, group: IntArray, spacing: float, way_x: float, way_y: float
) -> tuple[float, float]:
    """The offset [m] from a walker to their place beside the others of the group, which walks along (way_x, way_y)."""
    middle_x, middle_y, count = middle_of_group(walker, bodies, group)
    own = way_x * bodies[walker, 1] - way_y * bodies[walker, 0]
    rank = 0
    for other in range(len(group)):
        if other != walker and group[other] == group[walker]:
            beside = way_x * bodies[other, 1] - way_y * bodies[other, 0]
            rank += beside < own or (beside == own and other < walker)
    offset = (rank - (count - 1) / 2) * spacing
    return middle_x - way_y * offset - bodies[walker, 0], middle_y + way_x * offset - bodies[walker, 1]


@njit
def group_force(
    walker: int, bodies: FloatArray, group: IntArray, spacing: float, habits: Habits
) -> tuple[float, float]:
    """Acceleration of a walker by the group's gaze, cohesion and repulsion [m/s^2]."""
    middle_x, middle_y, count = middle_of_group(walker, bodies, group)
    x, y, heading, vx, vy, _ = bodies[walker]
    off_x, off_y = middle_x - x, middle_y - y
    distance = math.hypot(off_x, off_y)
    force_x, force_y = 0.0, 0.0
    if distance > 1e-6:
        aside = math.cos(heading) * off_y - math.sin(heading) * off_x
        ahead = math.cos(heading) * off_x + math.sin(heading) * off_y
        head_turn = max(0.0, abs(math.atan2(aside, ahead)) - HEAD_TURN_FREE)
        force_x, force_y = -habits.group_gaze * head_turn * vx, -habits.group_gaze * head_turn * vy
        if distance > COHESION_REACH * (count - 1):
            force_x += habits.group_cohesion * off_x / distance
            force_y += habits.group_cohesion * off_y / distance
    for other in range(len(group)):
        if other != walker and group[other] == group[walker]:
            dx, dy = bodies[other, 0] - x, bodies[other, 1] - y
            apart = max(math.hypot(dx, dy), 1e-6)
            if apart < spacing:
                force_x -= habits.group_repulsion * dx / apart
                force_y -= habits.group_repulsion * dy / apart
    return force_x, force_y
