"""The arithmetic of observations, compiled: numbers in the robot's frame, written into a row of float32."""

from __future__ import annotations

import math

import numpy as np

from reward_model.base.arrays import Float32Array, FloatArray, IntArray
from reward_model.base.numba import njit
from socnav_env.geometry.distances import wall_distances
from socnav_env.geometry.frames import (
    closed_lines,
    lines_between,
    poses_in_frame,
    turned_velocities,
)
from socnav_env.observations.sensors import Sight


@njit
def write_entities(
    row: Float32Array,
    starts: IntArray,
    capacities: IntArray,
    nearest_first: bool,
    pose: FloatArray,
    velocity: FloatArray,
    time_left: float,
    goal: FloatArray,
    corners: FloatArray,
    people_poses: FloatArray,
    people_velocities: FloatArray,
    object_poses: FloatArray,
    object_sizes: FloatArray,
    interaction_pairs: IntArray,
) -> None:
    """Write all of a row. Of more entities than there is room for, the nearest get rows.

    The others are those of `Sight`: handing a tuple of arrays to compiled code takes a microsecond longer.

    Args:
        starts: (2 + 2 * num_kinds,) where the parts of a row begin: the robot, the goal, rows and a mask of each kind
        capacities: (num_kinds,) rows of people, objects, walls and, where they are shown, interactions
        nearest_first: whether entities are sorted by their distance; otherwise they keep their order in the room
        pose, velocity: (3,) of the robot in the world
        time_left: share of the episode's time
        goal: (2,)
        corners: (num_corners, 2) of the room
    """
    sight = Sight(people_poses, people_velocities, object_poses, object_sizes, interaction_pairs)
    row[:] = 0.0
    write_robot(row[starts[0] :], pose, velocity, time_left)
    write_points(row[starts[1] : starts[1] + 2], pose, goal)
    chosen = _chosen_poses(sight.people_poses, pose, capacities[0], nearest_first)
    _write_people(_rows(row, starts, 2, len(chosen), 8), pose, sight, chosen)
    chosen = _chosen_poses(sight.object_poses, pose, capacities[1], nearest_first)
    _write_objects(_rows(row, starts, 4, len(chosen), 6), pose, sight, chosen)
    walls = closed_lines(corners)
    chosen = _chosen_lines(walls, pose, capacities[2], nearest_first)
    write_points(_rows(row, starts, 6, len(chosen), 4), pose, walls[chosen])
    if len(capacities) > 3:
        links = lines_between(sight.interaction_pairs, sight.people_poses, sight.object_poses)
        chosen = _chosen_lines(links, pose, capacities[3], nearest_first)
        write_points(_rows(row, starts, 8, len(chosen), 4), pose, links[chosen])


@njit
def _chosen_poses(poses: FloatArray, pose: FloatArray, capacity: int, nearest_first: bool) -> IntArray:
    """The entities that get rows, by the distances of their centres."""
    if len(poses) <= capacity and not nearest_first:
        return np.arange(len(poses))
    return _nearest(np.hypot(poses[:, 0] - pose[0], poses[:, 1] - pose[1]), capacity, nearest_first)


@njit
def _chosen_lines(lines: FloatArray, pose: FloatArray, capacity: int, nearest_first: bool) -> IntArray:
    """The lines that get rows, by the distances of their nearest points."""
    if len(lines) <= capacity and not nearest_first:
        return np.arange(len(lines))
    return _nearest(wall_distances(pose[0], pose[1], lines), capacity, nearest_first)


@njit
def _nearest(distances: FloatArray, capacity: int, nearest_first: bool) -> IntArray:
    """The places of the smallest distances, smallest first or in their own order."""
    nearest: IntArray = np.argsort(distances, kind="mergesort")[:capacity]  # a stable sort
    return nearest if nearest_first else np.sort(nearest)


@njit
def _rows(row: Float32Array, starts: IntArray, part: int, count: int, width: int) -> Float32Array:
    """Mark rows as present, in the part after theirs, and return them to be written, (count, width)."""
    row[starts[part + 1] : starts[part + 1] + count] = 1.0
    return row[starts[part] : starts[part] + count * width].reshape(count, width)


@njit
def write_robot(row: Float32Array, pose: FloatArray, velocity: FloatArray, time_left: float) -> None:
    """Write (4,) forward speed, speed to the left, turn rate, share of the time that is left."""
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    row[0] = cosine * velocity[0] + sine * velocity[1]
    row[1] = cosine * velocity[1] - sine * velocity[0]
    row[2] = velocity[2]
    row[3] = time_left


@njit
def write_points(rows: Float32Array, pose: FloatArray, points: FloatArray) -> None:
    """Write points, any number of x, y in a row, into rows of the same shape."""
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    flat_rows, flat_points = rows.reshape(-1, 2), points.reshape(-1, 2)
    for index in range(len(flat_points)):
        x, y = flat_points[index, 0] - pose[0], flat_points[index, 1] - pose[1]
        flat_rows[index, 0] = cosine * x + sine * y
        flat_rows[index, 1] = cosine * y - sine * x


@njit
def _write_people(rows: Float32Array, pose: FloatArray, sight: Sight, chosen: IntArray) -> None:
    local, moving = poses_in_frame(pose, sight.people_poses), turned_velocities(pose[2], sight.people_velocities)
    interacting = np.zeros(len(local))
    for index in sight.interaction_pairs.ravel():
        if index < len(local):
            interacting[index] = 1.0
    for row, index in enumerate(chosen):
        _write_pose(rows[row], local[index])
        rows[row, 4:7] = moving[index]
        rows[row, 7] = interacting[index]


@njit
def _write_objects(rows: Float32Array, pose: FloatArray, sight: Sight, chosen: IntArray) -> None:
    local = poses_in_frame(pose, sight.object_poses)
    for row, index in enumerate(chosen):
        _write_pose(rows[row], local[index])
        rows[row, 4:] = sight.object_sizes[index]


@njit
def _write_pose(row: Float32Array, local: FloatArray) -> None:
    """Write (4,) x, y, cosine and sine of the heading."""
    row[0], row[1], row[2], row[3] = local[0], local[1], math.cos(local[2]), math.sin(local[2])
