"""Distances between the robot's surface and what is around it, independent of the simulator and the graph.

Any finite coordinates will do; distances beyond the largest number are infinite. The robot stands at the origin, as in
every `Snapshot`.
"""

from __future__ import annotations

import numpy as np

from reward_model.base.arrays import FloatArray
from reward_model.scenes.scene import Objects, Snapshot

RADIUS = 0.25  # m, of the robot and of people, as in the simulator
_EXACT = 20.0  # m, up to this distance and size contact with an object is exact
_DOUBT = 1e-6  # of a length beyond that: float32, in which networks compute, has seven digits


@np.errstate(over="ignore")
def clearance(snapshot: Snapshot) -> float:
    """The distance [m] from the robot's surface to the nearest person, object or wall; negative where they overlap."""
    return float(np.concatenate(_clearances(snapshot)).min(initial=np.inf))


@np.errstate(over="ignore")
def in_contact(snapshot: Snapshot) -> bool:
    """Whether the robot touches or overlaps a person, an object or a wall, without a doubt in float32.

    Clearances are at most 0; those of objects more than 20 m large or away, at most minus a millionth of the excess.
    """
    people, objects, walls = _clearances(snapshot)
    reach = _lengths(snapshot.objects.poses[:, :2]) + snapshot.objects.sizes.sum(axis=1)
    doubt = _DOUBT * np.maximum(reach - _EXACT, 0.0)
    return bool((people <= 0).any() or (objects <= -doubt).any() or (walls <= 0).any())


def _clearances(snapshot: Snapshot) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Distances [m] from the robot's surface to each person, object and wall."""
    people = _lengths(snapshot.people.poses[:, :2]) - 2 * RADIUS
    return people, _box_distances(snapshot.objects) - RADIUS, _wall_distances(snapshot.walls) - RADIUS


def _lengths(points: FloatArray) -> FloatArray:
    lengths: FloatArray = np.hypot(points[:, 0], points[:, 1])
    return lengths


def _box_distances(objects: Objects) -> FloatArray:
    """Distances (num_objects,) [m] from the origin to rectangles, negative inside: the depth below the nearest side."""
    x, y, heading = objects.poses.T
    cosine, sine = np.cos(heading), np.sin(heading)
    # Width is along the object's own x axis. Halves, because the sum of two of the largest numbers is too large.
    along = np.abs(cosine * (x / 2) + sine * (y / 2)) - objects.sizes[:, 0] / 4
    across = np.abs(cosine * (y / 2) - sine * (x / 2)) - objects.sizes[:, 1] / 4
    outside = np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0))
    distances: FloatArray = 2 * np.where(outside > 0, outside, np.maximum(along, across))
    return distances


def _wall_distances(walls: FloatArray) -> FloatArray:
    """Distances (num_walls,) [m] from the origin to segments, which may be points."""
    scale = np.abs(walls).max(axis=1, initial=0.0)
    scale[scale == 0] = 1.0
    begin, end = walls[:, :2] / scale[:, None], walls[:, 2:] / scale[:, None]
    along = end - begin
    squared = (along**2).sum(axis=1)
    share = -(begin * along).sum(axis=1) / np.where(squared > 0, squared, 1.0)
    nearest = begin + np.clip(share, 0.0, 1.0)[:, None] * along
    return _lengths(nearest) * scale
