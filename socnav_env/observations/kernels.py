"""The arithmetic of `entities` and `flat`, compiled: rows in the robot's frame."""

from __future__ import annotations

import math

import numpy as np

from reward_model.base.arrays import Float32Array, FloatArray, IntArray
from reward_model.base.numba import njit
from socnav_env.geometry.distances import wall_distances
from socnav_env.geometry.frames import closed_lines, lines_between, poses_in_frame, turned_velocities


@njit
def write_entities(
    row: Float32Array,
    starts: IntArray,
    capacities: IntArray,
    frame: FloatArray,
    velocity: FloatArray,
    time_left: float,
    goal: FloatArray,
    people: FloatArray,
    people_velocities: FloatArray,
    objects: FloatArray,
    sizes: FloatArray,
    corners: FloatArray,
    pairs: IntArray,
) -> None:
    """Write everything, in the order and from the places on that `EntitiesObservation` has set, in `starts`."""
    row[:] = 0.0
    write_robot(row[starts[0] :], frame, velocity, time_left)
    write_points(row[starts[1] : starts[1] + 2], frame, goal)
    chosen = _nearest(people, frame, capacities[0])
    _write_people(_rows(row, starts, 2, len(chosen), 8), frame, people, people_velocities, pairs, chosen)
    chosen = _nearest(objects, frame, capacities[1])
    _write_objects(_rows(row, starts, 4, len(chosen), 6), frame, objects, sizes, chosen)
    walls = closed_lines(corners)
    chosen = _nearest_lines(walls, frame, capacities[2])
    write_points(_rows(row, starts, 6, len(chosen), 4), frame, walls[chosen])
    links = lines_between(pairs, people, objects)
    chosen = _nearest_lines(links, frame, capacities[3])
    write_points(_rows(row, starts, 8, len(chosen), 4), frame, links[chosen])


@njit
def write_nearest(
    row: Float32Array,
    starts: IntArray,
    capacities: IntArray,
    frame: FloatArray,
    velocity: FloatArray,
    time_left: float,
    goal: FloatArray,
    people: FloatArray,
    people_velocities: FloatArray,
    objects: FloatArray,
    sizes: FloatArray,
    corners: FloatArray,
    pairs: IntArray,
) -> None:
    """Write the nearest first, in the order and from the places on that `FlatObservation` has set, in `starts`."""
    row[:] = 0.0
    write_robot(row[starts[0] :], frame, velocity, time_left)
    write_points(row[starts[1] : starts[1] + 2], frame, goal)
    chosen = _first(np.hypot(people[:, 0] - frame[0], people[:, 1] - frame[1]), capacities[0])
    _write_people(_rows(row, starts, 2, len(chosen), 8), frame, people, people_velocities, pairs, chosen)
    chosen = _first(np.hypot(objects[:, 0] - frame[0], objects[:, 1] - frame[1]), capacities[1])
    _write_objects(_rows(row, starts, 4, len(chosen), 6), frame, objects, sizes, chosen)
    walls = closed_lines(corners)
    chosen = _first(wall_distances(frame[0], frame[1], walls), capacities[2])
    write_points(_rows(row, starts, 6, len(chosen), 4), frame, walls[chosen])


@njit
def _first(distances: FloatArray, capacity: int) -> IntArray:
    """The places of the smallest distances, smallest first."""
    first: IntArray = np.argsort(distances, kind="mergesort")[:capacity]  # a stable sort
    return first


@njit
def _nearest(places: FloatArray, frame: FloatArray, capacity: int) -> IntArray:
    """Which of the entities get rows: all, or the nearest where there are too many, in their order."""
    if len(places) <= capacity:
        return np.arange(len(places))
    distances = np.hypot(places[:, 0] - frame[0], places[:, 1] - frame[1])
    nearest: IntArray = np.sort(np.argsort(distances, kind="mergesort")[:capacity])  # a stable sort
    return nearest


@njit
def _nearest_lines(lines: FloatArray, frame: FloatArray, capacity: int) -> IntArray:
    """Which of the lines get rows, likewise, by their nearest points."""
    if len(lines) <= capacity:
        return np.arange(len(lines))
    nearest: IntArray = np.sort(_first(wall_distances(frame[0], frame[1], lines), capacity))
    return nearest


@njit
def _rows(row: Float32Array, starts: IntArray, part: int, count: int, width: int) -> Float32Array:
    """Mark rows as present, in the part after theirs, and return them to be written, (count, width)."""
    row[starts[part + 1] : starts[part + 1] + count] = 1.0
    return row[starts[part] : starts[part] + count * width].reshape(count, width)


@njit
def write_robot(row: Float32Array, frame: FloatArray, velocity: FloatArray, time_left: float) -> None:
    """Write (4,) forward speed, speed to the left, turn rate, share of the time that is left."""
    cosine, sine = math.cos(frame[2]), math.sin(frame[2])
    row[0] = cosine * velocity[0] + sine * velocity[1]
    row[1] = cosine * velocity[1] - sine * velocity[0]
    row[2] = velocity[2]
    row[3] = time_left


@njit
def write_points(rows: Float32Array, frame: FloatArray, points: FloatArray) -> None:
    """Write points, any number of x, y in a row, into rows of the same shape."""
    cosine, sine = math.cos(frame[2]), math.sin(frame[2])
    flat_rows, flat_points = rows.reshape(-1, 2), points.reshape(-1, 2)
    for index in range(len(flat_points)):
        x, y = flat_points[index, 0] - frame[0], flat_points[index, 1] - frame[1]
        flat_rows[index, 0] = cosine * x + sine * y
        flat_rows[index, 1] = cosine * y - sine * x


@njit
def _write_people(
    rows: Float32Array,
    frame: FloatArray,
    poses: FloatArray,
    velocities: FloatArray,
    pairs: IntArray,
    chosen: IntArray,
) -> None:
    local, moving = poses_in_frame(frame, poses), turned_velocities(frame[2], velocities)
    interacting = np.zeros(len(poses))
    for index in pairs.ravel():
        if index < len(poses):
            interacting[index] = 1.0
    for row, index in enumerate(chosen):
        rows[row, :2] = local[index, :2]
        rows[row, 2] = math.cos(local[index, 2])
        rows[row, 3] = math.sin(local[index, 2])
        rows[row, 4:7] = moving[index]
        rows[row, 7] = interacting[index]


@njit
def _write_objects(
    rows: Float32Array, frame: FloatArray, poses: FloatArray, sizes: FloatArray, chosen: IntArray
) -> None:
    local = poses_in_frame(frame, poses)
    for row, index in enumerate(chosen):
        rows[row, :2] = local[index, :2]
        rows[row, 2] = math.cos(local[index, 2])
        rows[row, 3] = math.sin(local[index, 2])
        rows[row, 4:] = sizes[index]
