"""The shortest path of a round robot past walls and objects, exact up to rounding.

The shortest path of a disc among straight edges consists of straight lines and of arcs around the edges' ends. Each
line is tangent to the circles at its ends, which have the robot's radius (Liu & Arimoto, Path planning using a tangent
graph for mobile robots among polygonal and curved obstacles, 1992). The tangents on which the robot fits and the arcs
between their touching points form a graph that contains the shortest path; SciPy's Dijkstra finds it.
"""

from __future__ import annotations

import math

import numpy as np

from reward_model.base.arrays import FloatArray, IntArray
from reward_model.base.numba import njit
from socnav_env.geometry.distances import boxes_of, closest_on_wall
from socnav_env.layout import Layout

ROUNDING = 1e-7  # m by which a path may come closer than the robot's radius
ARC_STEP = math.radians(2)  # between the checked points of an arc: it bulges by 0.04 mm in between
CORNERS = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])


def edges_of(layout: Layout) -> FloatArray:
    """(num_edges, 4) x1, y1, x2, y2 [m] of the walls and of the objects' sides."""
    # A laptop has the pose and size of its table.
    boxes = np.unique(boxes_of(layout.object_poses, layout.object_sizes), axis=0)
    along = boxes[:, None, 2:4] * (CORNERS[:, 0] * boxes[:, 4:5])[..., None]
    across = boxes[:, None, [3, 2]] * [-1.0, 1.0] * (CORNERS[:, 1] * boxes[:, 5:6])[..., None]
    corners = boxes[:, None, :2] + along + across
    sides = np.concatenate([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 4)
    return np.vstack([layout.room.walls, sides])


def shortest_path_length(start: FloatArray, goal: FloatArray, radius: float, edges: FloatArray) -> float:
    """Length [m] of the shortest path of the robot's centre from `start` to `goal`; inf if there is no path.

    Args:
        start, goal: (2,)
        radius: [m] of the robot
        edges: (num_edges, 4) x1, y1, x2, y2 of all obstacles
    """
    if fits(start, goal, radius - ROUNDING, edges):
        return math.dist(start, goal)
    centers = np.vstack([start, goal, np.unique(edges.reshape(-1, 2), axis=0)])
    touches, owners = _tangents(centers, radius, edges)
    return _graph_distance(centers, radius, edges, touches, owners)


def _graph_distance(
    centers: FloatArray, radius: float, edges: FloatArray, touches: FloatArray, owners: IntArray
) -> float:
    """Length of the shortest path from the first to the second centre over tangents and arcs."""
    from scipy.sparse import coo_array  # slow to import
    from scipy.sparse.csgraph import dijkstra

    count = len(touches)
    nodes = np.where(owners < 2, owners, np.arange(2, count + 2))  # start and goal, then every touching point
    lengths = np.hypot(*(touches[1::2] - touches[::2]).T)
    arc_ends, arc_lengths = _arcs(centers, radius, edges, touches, owners)
    rows = np.concatenate([nodes[::2], arc_ends[:, 0] + 2])
    columns = np.concatenate([nodes[1::2], arc_ends[:, 1] + 2])
    # A sparse graph takes a weight of 0, as between two touching points at one place, for no edge.
    weights = np.maximum(np.concatenate([lengths, arc_lengths]), 1e-12)
    graph = coo_array((weights, (rows, columns)), shape=(count + 2, count + 2)).tocsr()
    return float(dijkstra(graph, directed=False, indices=0)[1])


def _arcs(
    centers: FloatArray, radius: float, edges: FloatArray, touches: FloatArray, owners: IntArray
) -> tuple[IntArray, FloatArray]:
    """Arcs from each touching point to the next one on its circle: (num_arcs, 2) touching points, and lengths [m]."""
    ends, lengths = [], []
    offsets = touches - centers[owners]
    angles = np.arctan2(offsets[:, 1], offsets[:, 0])
    for owner in np.unique(owners[owners >= 2]).tolist():
        around = np.flatnonzero(owners == owner)
        around = around[np.argsort(angles[around], kind="stable")]
        for first, second in zip(around.tolist(), np.roll(around, -1).tolist(), strict=True):
            turn = float(angles[second] - angles[first]) % (2 * math.pi)
            if _arc_fits(centers[owner], float(angles[first]), turn, radius, edges):
                ends.append((first, second))
                lengths.append(radius * turn)
    return np.array(ends, dtype=np.int64).reshape(-1, 2), np.array(lengths)


@njit
def fits(start: FloatArray, end: FloatArray, margin: float, edges: FloatArray) -> bool:
    """Whether a body of radius `margin` [m] can go straight from `start` to `end` between edges (num_edges, 4)."""
    line = np.array([start[0], start[1], end[0], end[1]])
    for edge in edges:  # noqa: SIM110 - numba does not compile generators
        if _segment_distance(line, edge) < margin:
            return False
    return True


@njit
def _point_distance(x: float, y: float, segment: FloatArray) -> float:
    if segment[0] == segment[2] and segment[1] == segment[3]:
        return math.hypot(x - segment[0], y - segment[1])
    near_x, near_y = closest_on_wall(x, y, segment)
    return math.hypot(x - near_x, y - near_y)


@njit
def _side(line: FloatArray, x: float, y: float) -> float:
    """The side of a line on which (x, y) lies: positive to the left, negative to the right."""
    return float((line[2] - line[0]) * (y - line[1]) - (line[3] - line[1]) * (x - line[0]))


@njit
def _segment_distance(one: FloatArray, other: FloatArray) -> float:
    """Distance between two segments [m], 0 if they cross."""
    apart = _side(one, other[0], other[1]) * _side(one, other[2], other[3])
    if apart < 0.0 and _side(other, one[0], one[1]) * _side(other, one[2], one[3]) < 0.0:
        return 0.0
    return min(
        _point_distance(one[0], one[1], other),
        _point_distance(one[2], one[3], other),
        _point_distance(other[0], other[1], one),
        _point_distance(other[2], other[3], one),
    )


@njit
def _tangents(centers: FloatArray, radius: float, edges: FloatArray) -> tuple[FloatArray, IntArray]:
    """The tangents on which the robot fits: their touching points, two rows (n, 2) each, and the points' circles (n,).

    The first two centres are points, all others circles.
    """
    touches, owners = [], []
    margin = radius - ROUNDING
    for first in range(len(centers)):
        for second in range(first + 1, len(centers)):
            near, far = (0.0 if first < 2 else radius), (0.0 if second < 2 else radius)
            offset = centers[second] - centers[first]
            distance = math.hypot(offset[0], offset[1])
            # An outer tangent touches both circles on the same side, an inner one on opposite sides.
            for kind in range(1 if near == 0.0 else 2):
                reach = far if kind == 0 else -far
                if distance == 0.0 or abs(near - reach) > distance:
                    continue
                cosine = (near - reach) / distance
                sine = math.sqrt(1.0 - cosine * cosine)
                for sign in (-1.0, 1.0):
                    x = (cosine * offset[0] - sign * sine * offset[1]) / distance
                    y = (cosine * offset[1] + sign * sine * offset[0]) / distance
                    normal = np.array([x, y])
                    start, end = centers[first] + near * normal, centers[second] + reach * normal
                    if fits(start, end, margin, edges):
                        touches.append(start)
                        touches.append(end)
                        owners.append(first)
                        owners.append(second)
    result = np.empty((len(touches), 2))
    for index in range(len(touches)):
        result[index] = touches[index]
    return result, np.array(owners, dtype=np.int64)


@njit
def _arc_fits(center: FloatArray, angle: float, turn: float, radius: float, edges: FloatArray) -> bool:
    """Whether the robot can go around `center` counter-clockwise by `turn` [rad] from `angle` [rad] on."""
    count = max(math.ceil(turn / ARC_STEP), 1)
    for index in range(count + 1):
        x = center[0] + radius * math.cos(angle + turn * index / count)
        y = center[1] + radius * math.sin(angle + turn * index / count)
        for edge in edges:
            if _point_distance(x, y, edge) < radius - ROUNDING:
                return False
    return True
