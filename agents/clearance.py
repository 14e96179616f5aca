"""How far the robot could drive straight on in every direction before it touches something.

Computed from the rows of the `entities` observation, in plain tensor operations without anything to learn. A small
network that sees positions alone takes millions of steps to work this out; steering around people needs it.
"""

from __future__ import annotations

import torch
from torch import Tensor

ROBOT_RADIUS = 0.25  # m, the default robot's; the observation does not tell
PERSON_RADIUS = 0.25  # m, likewise
SIGHT = 4.0  # m, free distances are cut off at this
TINY = 1e-6


def free_distances(rows: dict[str, Tensor], masks: dict[str, Tensor], headings: Tensor) -> Tensor:
    """Return how far the robot's body can move along each heading.

    Args:
        rows: people (batch, n, 8), objects (batch, n, 6) and walls (batch, n, 4), where there are any.
        masks: (batch, n) each, 1 where a row is present.
        headings: (batch, num_headings) [rad] in the robot's frame.

    Returns:
        (batch, num_headings) [m], from 0 to 4.

    """
    cosine, sine = headings.cos()[:, None], headings.sin()[:, None]  # (batch, 1, num_headings)
    nearest = torch.full_like(headings, SIGHT)
    for kind, measure in (("people", _to_people), ("objects", _to_boxes), ("walls", _to_walls)):
        if kind in rows:
            distances, hits = measure(rows[kind], cosine, sine)
            seen = torch.where(hits & (masks[kind] > 0)[..., None], distances, SIGHT)
            nearest = torch.minimum(nearest, seen.amin(dim=1))
    return nearest.clamp(min=0.0)


def _to_people(rows: Tensor, cosine: Tensor, sine: Tensor) -> tuple[Tensor, Tensor]:
    """Distance to touching each disc and whether the way leads there, both (batch, n, num_headings)."""
    x, y = rows[..., 0:1], rows[..., 1:2]
    along, aside = x * cosine + y * sine, y * cosine - x * sine
    chord = (ROBOT_RADIUS + PERSON_RADIUS) ** 2 - aside * aside
    return along - chord.clamp(min=0.0).sqrt(), (chord > 0) & (along > 0)


def _to_boxes(rows: Tensor, cosine: Tensor, sine: Tensor) -> tuple[Tensor, Tensor]:
    """Distance to each box, widened by the robot's radius, by the slab method (Kay & Kajiya 1986)."""
    x, y, box_cosine, box_sine = (rows[..., column : column + 1] for column in range(4))
    origins = (-(x * box_cosine + y * box_sine), x * box_sine - y * box_cosine)
    steps = (cosine * box_cosine + sine * box_sine, sine * box_cosine - cosine * box_sine)
    enter, leave = torch.full_like(steps[0], -torch.inf), torch.full_like(steps[0], torch.inf)
    for axis in (0, 1):
        slowness = 1.0 / torch.where(steps[axis].abs() < TINY, TINY, steps[axis])
        middle = -origins[axis] * slowness
        reach = (rows[..., 4 + axis : 5 + axis] / 2 + ROBOT_RADIUS) * slowness.abs()
        enter, leave = torch.maximum(enter, middle - reach), torch.minimum(leave, middle + reach)
    return enter, (leave > enter) & (leave > 0)


def _to_walls(rows: Tensor, cosine: Tensor, sine: Tensor) -> tuple[Tensor, Tensor]:
    """Distance to touching the line of each wall, where the robot's centre would cross the wall."""
    x, y = rows[..., 0:1], rows[..., 1:2]
    along_x, along_y = rows[..., 2:3] - x, rows[..., 3:4] - y
    across = cosine * along_y - sine * along_x
    across = torch.where(across.abs() < TINY, TINY, across)
    distance = (x * along_y - y * along_x) / across
    share = (x * sine - y * cosine) / across
    length = torch.hypot(along_x, along_y)
    return distance - ROBOT_RADIUS * length / across.abs(), (distance > 0) & (share >= 0) & (share <= 1)
