"""How close the robot would come to anything on the arcs that it can drive: the dynamic window's view of a scene.

The robot turns slowly, so what is free straight ahead of it does not say which turn still misses a person. For a few
pairs of speed and turn rate this follows the arc (Fox et al. 1997) and notes the least clearance on the way. As with
the free distances there is nothing to learn in here, and everybody is taken to stay where they are.
"""

from __future__ import annotations

import torch
from torch import Tensor

from agents.clearance import PERSON_RADIUS, ROBOT_RADIUS

TOP_SPEED = 3.5 / 9.4  # m/s, the default robot's; the observation does not tell
TOP_TURN_RATE = 4 / 10.32  # rad/s, likewise
# Shares of the top speed and of the top turn rate.
ARCS = (
    *((1.0, turn / 4) for turn in range(-4, 5)),
    *((0.5, turn) for turn in (-1.0, 1.0)),
    *((-1.0, turn) for turn in (-1.0, 0.0, 1.0)),
)
TIME_STEP = 0.4  # s between two places of an arc
NUM_PLACES = 12
HORIZONS = (2, 4, 8, 12)  # places after which the least clearance so far is told
NUM_CLEARANCES = len(ARCS) * len(HORIZONS)
FAR = 1.0  # m, clearances are cut off at this
TINY = 1e-6


def arc_clearances(rows: dict[str, Tensor], masks: dict[str, Tensor], goal: Tensor) -> Tensor:
    """Return the least clearance of the robot's body along each arc up to each horizon.

    Args:
        rows: people (batch, n, 8), objects (batch, n, 6) and walls (batch, n, 4), where there are any.
        masks: (batch, n) each, 1 where a row is present.
        goal: (batch, 2), for the size and the device of what is returned.

    Returns:
        (batch, num_arcs * num_horizons) [m], below 0 where bodies would overlap, at most 1.

    """
    places = _places().to(goal.device)
    nearest = torch.full((len(goal), len(places)), FAR, device=goal.device)
    for kind, measure in (("people", _to_people), ("objects", _to_boxes), ("walls", _to_walls)):
        if kind in rows and rows[kind].shape[1]:
            clearance = torch.where(masks[kind][..., None] > 0, measure(rows[kind], places), FAR)
            nearest = torch.minimum(nearest, clearance.amin(dim=1))
    least: Tensor = torch.cummin(nearest.view(-1, len(ARCS), NUM_PLACES), dim=2).values
    return least[:, :, [horizon - 1 for horizon in HORIZONS]].flatten(1)


def _places() -> Tensor:
    """Where the arcs lead, (num_arcs * NUM_PLACES, 2) [m] in the robot's frame."""
    shares = torch.tensor(ARCS)
    speed, turn = TOP_SPEED * shares[:, :1], TOP_TURN_RATE * shares[:, 1:]
    time = TIME_STEP * torch.arange(1, NUM_PLACES + 1)
    half = turn * time / 2
    chord = speed * time * torch.sinc(half / torch.pi)  # 2 r sin(half), the arc's length where it is straight
    return torch.stack([chord * half.cos(), chord * half.sin()], dim=-1).flatten(0, 1)


def _to_people(rows: Tensor, places: Tensor) -> Tensor:
    """Clearance of the robot at each place from each disc, (batch, n, num_places)."""
    away = torch.hypot(rows[..., 0:1] - places[:, 0], rows[..., 1:2] - places[:, 1])
    return away - (ROBOT_RADIUS + PERSON_RADIUS)


def _to_boxes(rows: Tensor, places: Tensor) -> Tensor:
    x, y, cosine, sine, width, depth = (rows[..., column : column + 1] for column in range(6))
    dx, dy = places[:, 0] - x, places[:, 1] - y
    along = (dx * cosine + dy * sine).abs() - width / 2
    across = (dy * cosine - dx * sine).abs() - depth / 2
    outside = torch.hypot(along.clamp(min=0.0), across.clamp(min=0.0))
    return outside + torch.maximum(along, across).clamp(max=0.0) - ROBOT_RADIUS


def _to_walls(rows: Tensor, places: Tensor) -> Tensor:
    x, y = rows[..., 0:1], rows[..., 1:2]
    along_x, along_y = rows[..., 2:3] - x, rows[..., 3:4] - y
    dx, dy = places[:, 0] - x, places[:, 1] - y
    share = (dx * along_x + dy * along_y) / (along_x * along_x + along_y * along_y + TINY)
    share = share.clamp(0.0, 1.0)
    return torch.hypot(dx - share * along_x, dy - share * along_y) - ROBOT_RADIUS
