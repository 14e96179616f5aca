"""Reads the `entities` observation: a permutation-invariant, mask-aware features extractor for SB3 policies."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import Tensor, nn

from agents.features.arcs import FAR, NUM_CLEARANCES, arc_clearances
from agents.features.clearance import SIGHT, free_distances

POSITION_SCALE = 0.2  # 1/m, so that a room's positions lie within about -2..2
NEARNESS_SOFTENING = 0.3  # m, nearness is 1 / (distance + this)
POLAR_WIDTH = 6  # what `polar` makes of a point
NUM_HEADINGS = 36  # directions the robot looks in
CLOSENESS_SOFTENING = 0.1  # m, likewise of clearances on the arcs
CORRIDOR_WIDTH = 3  # and `corridor`
ASIDE = 1.5  # m, further aside than this is out of the way
TINY = 1e-6  # m, keeps directions finite at the origin
OWN, FREE = "own", "free"  # of what `describe` returns; observations have nothing of these names


class EntityFeatures(BaseFeaturesExtractor):
    """Pools encoded entities by type, and looks how far the robot could drive in every direction.

    Each entity is described by its point closest to the robot (as `polar` and `corridor` give it) and its own
    attributes. A type's encoder lifts that to `hidden` numbers, to which the encoded robot and goal are added; a
    second layer, shared by all types, follows, and then the maximum over the members of each type, 0 where there
    are none. A type that the configuration rules out has no part in it. Beside these stand the robot's state, the
    goal, the free distances along headings counted from the one towards the goal, and the clearances on the arcs that
    the robot can drive, in one layer of 2 * `hidden`.

    Reordering the rows of a type, or changing rows whose mask is 0, changes nothing.

    Args:
        observation_space: the Dict space of the `entities` observation; capacities and row widths follow from it.
        hidden: how many numbers encode one entity.
    """

    def __init__(self, observation_space: spaces.Dict, hidden: int = 32) -> None:
        self.capacities = capacities_of(observation_space)
        super().__init__(observation_space, features_dim=(len(self.capacities) + 2) * hidden)
        self.encoders = nn.ModuleDict(
            {kind: nn.Linear(POLAR_WIDTH + CORRIDOR_WIDTH + ATTRIBUTES[kind].width, hidden) for kind in self.capacities}
        )
        own_width = _length(observation_space, "robot") + POLAR_WIDTH
        self.context = nn.Linear(own_width, hidden)
        self.own = nn.Linear(own_width + 2 * (NUM_HEADINGS + NUM_CLEARANCES), 2 * hidden)
        self.shared = nn.Linear(hidden, hidden)

    def forward(self, observations: dict[str, Tensor] | Described) -> Tensor:
        """Return the features of a batch of observations, or of what `described` made of it: (batch, features_dim)."""
        given = observations if isinstance(observations, Described) else described(observations, self.capacities)
        features = [torch.relu(self.own(torch.cat([given.own, given.free], dim=1)))]
        if self.capacities:
            rows = torch.cat([self.encoders[kind](given.rows[kind]) for kind in self.capacities])
            rows = torch.relu(rows + self.context(given.own)[given.samples])
            rows = torch.relu(self.shared(rows))  # (present, hidden)
            pooled = greatest(rows, given.counts)
            features.append(pooled.view(len(self.capacities), -1, rows.shape[1]).transpose(0, 1).flatten(1))
        return torch.cat(features, dim=1)


def greatest(rows: Tensor, counts: Tensor) -> Tensor:
    """Return the maximum of each part of rows (num_rows, width) that are at least 0; 0 where a part is empty.

    Args:
        counts: (num_parts,) how many rows each part has. Equal rows (a table and the laptop on it stand at one place)
            share the gradient; `torch.segment_reduce` gets it wrong for them.
    """
    parts = torch.repeat_interleave(torch.arange(len(counts)), counts)
    nothing = torch.zeros(len(counts), rows.shape[1])
    return nothing.scatter_reduce(0, parts[:, None].expand_as(rows), rows, "amax")


class Described(NamedTuple):
    """A batch of observations as the first layers read it; networks of the same sizes share it.

    Entities that are present stand below each other, type after type and within a type sample after sample.

    Attributes:
        own: (batch, robot + 6) the robot's state and the goal as `polar` gives it
        free: (batch, 2 * (num_headings + num_clearances)) see `look_around`
        rows: of each type (present, width), see `describe`
        samples: (present,) whose entity each row is, all types in one
        counts: (types * batch,) how many rows each type of each sample has
    """

    own: Tensor
    free: Tensor
    rows: dict[str, Tensor]
    samples: Tensor
    counts: Tensor


def described(observations: dict[str, Tensor], capacities: dict[str, int]) -> Described:
    """Turn observations into what the first layers read, or what `describe` has made of them."""
    given = observations if OWN in observations else describe(observations, capacities)
    present = [given[f"{kind}_mask"] > 0 for kind in capacities]
    rows = {kind: given[kind][mask] for kind, mask in zip(capacities, present, strict=True)}
    samples = [mask.nonzero()[:, 0] for mask in present]
    counts = [mask.sum(dim=1) for mask in present]
    nothing = torch.empty(0, dtype=torch.int64)
    return Described(given[OWN], given[FREE], rows, torch.cat([nothing, *samples]), torch.cat([nothing, *counts]))


def capacities_of(observation_space: spaces.Dict) -> dict[str, int]:
    """Return how many entities of each type the observation has room for."""
    return {kind: _length(observation_space, f"{kind}_mask") for kind in ATTRIBUTES if kind in observation_space.spaces}


@torch.no_grad()
def describe(observations: dict[str, Tensor], capacities: dict[str, int]) -> dict[str, Tensor]:
    """Work out what the first layers read, in which there is nothing to learn: it lasts as long as observations do.

    Returns:
        own, free: see `Described`
        people, objects, walls, interactions: (batch, capacity, width) the closest point as `polar` and `corridor`
            give it, then the attributes
        people_mask and so on: as they were
    """
    rows = {kind: torch.unflatten(observations[kind], 1, (capacity, -1)) for kind, capacity in capacities.items()}
    masks = {kind: observations[f"{kind}_mask"] for kind in rows}
    goal = observations["goal"]
    points = torch.cat([goal[:, None], *(ATTRIBUTES[kind].closest(rows[kind]) for kind in rows)], dim=1)
    places = torch.cat([polar(points), corridor(points, goal)], dim=-1)
    aim, *others = torch.split(places, [1, *capacities.values()], dim=1)
    made = {OWN: torch.cat([observations["robot"], aim[:, 0, :POLAR_WIDTH]], dim=1)}
    made[FREE] = look_around(goal, rows, masks)
    for kind, closest in zip(rows, others, strict=True):
        made[kind] = torch.cat([closest, ATTRIBUTES[kind].of(rows[kind], closest)], dim=-1)
        made[f"{kind}_mask"] = masks[kind]
    return made


def look_around(goal: Tensor, rows: dict[str, Tensor], masks: dict[str, Tensor]) -> Tensor:
    """Return free distances, clearances on arcs, and the nearness of both, 36 and 56 numbers each.

    Distances and clearances are scaled to 0..1, heading 0 is the goal's.
    """
    headings = torch.arange(NUM_HEADINGS, device=goal.device) * (2 * math.pi / NUM_HEADINGS)
    free = free_distances(rows, masks, torch.atan2(goal[:, 1:], goal[:, :1]) + headings)
    left = arc_clearances(rows, masks, goal).clamp(min=0.0)
    return torch.cat(
        [
            free / SIGHT,
            NEARNESS_SOFTENING / (free + NEARNESS_SOFTENING),
            left / FAR,
            CLOSENESS_SOFTENING / (left + CLOSENESS_SOFTENING),
        ],
        dim=1,
    )


def polar(points: Tensor) -> Tensor:
    """Describe points (..., 2) [m] by six numbers.

    They are the scaled position, the direction (cosine and sine of the bearing), the scaled distance and the
    nearness 1 / (distance + 0.3 m).
    """
    distance = torch.linalg.vector_norm(points, dim=-1, keepdim=True)
    return torch.cat(
        [
            points * POSITION_SCALE,
            points / (distance + TINY),
            distance * POSITION_SCALE,
            1.0 / (distance + NEARNESS_SOFTENING),
        ],
        dim=-1,
    )


def corridor(points: Tensor, goal: Tensor) -> Tensor:
    """Describe points (batch, n, 2) [m] by three numbers that say whether they are in the way.

    They are how far they lie to the left of the robot's nose and to the left of its way to the goal (batch, 2),
    both [m] and cut off at 1.5 m, and their scaled distance along that way.
    """
    way = (goal / (torch.linalg.vector_norm(goal, dim=-1, keepdim=True) + TINY))[:, None]
    along = (points * way).sum(dim=-1)
    left = points[..., 1] * way[..., 0] - points[..., 0] * way[..., 1]
    return torch.stack([points[..., 1].clamp(-ASIDE, ASIDE), left.clamp(-ASIDE, ASIDE), along * POSITION_SCALE], dim=-1)


def closest_on_segments(segments: Tensor) -> Tensor:
    """Return the points (..., 2) closest to the origin on segments (..., 4) given as x1, y1, x2, y2."""
    start = segments[..., :2]
    along = segments[..., 2:] - start
    share = -(start * along).sum(dim=-1, keepdim=True) / ((along * along).sum(dim=-1, keepdim=True) + TINY)
    return start + share.clamp(0.0, 1.0) * along


def closest_on_boxes(boxes: Tensor) -> Tensor:
    """Return the points (..., 2) closest to the origin on boxes (..., 6).

    A box is given as x, y of its centre, cosine and sine of its heading, width along the heading and depth.
    """
    centre, cosine, sine = boxes[..., :2], boxes[..., 2:3], boxes[..., 3:4]
    axis = torch.cat([cosine, sine], dim=-1)
    normal = torch.cat([-sine, cosine], dim=-1)
    half = boxes[..., 4:6] / 2
    along = -(centre * axis).sum(dim=-1, keepdim=True).clamp(-half[..., :1], half[..., :1])
    across = -(centre * normal).sum(dim=-1, keepdim=True).clamp(-half[..., 1:], half[..., 1:])
    return centre + along * axis + across * normal


class Attributes(NamedTuple):
    """What is read off the rows of one type.

    Attributes:
        closest: rows (..., row width) to the points (..., 2) closest to the robot
        of: rows and their closest points as `polar` gives them to the attributes (..., width)
    """

    width: int
    closest: Callable[[Tensor], Tensor]
    of: Callable[[Tensor, Tensor], Tensor]


def _people_attributes(rows: Tensor, closest: Tensor) -> Tensor:
    """Add the speed at which somebody moves away along the line from the robot to the person."""
    parting = (rows[..., 4:6] * closest[..., 2:4]).sum(dim=-1, keepdim=True)
    return torch.cat([rows[..., :2] * POSITION_SCALE, rows[..., 2:], parting], dim=-1)


def _object_attributes(rows: Tensor, closest: Tensor) -> Tensor:
    return torch.cat([rows[..., :2] * POSITION_SCALE, rows[..., 2:]], dim=-1)


def _line_attributes(rows: Tensor, closest: Tensor) -> Tensor:
    return rows * POSITION_SCALE


ATTRIBUTES = {
    "people": Attributes(9, lambda rows: rows[..., :2], _people_attributes),
    "objects": Attributes(6, closest_on_boxes, _object_attributes),
    "walls": Attributes(4, closest_on_segments, _line_attributes),
    "interactions": Attributes(4, closest_on_segments, _line_attributes),
}


def _length(space: spaces.Dict, key: str) -> int:
    shape = space[key].shape
    assert shape is not None, f"{key} is a Box"
    return shape[0]
