"""What the agent sees: a class per kind, each with `space()` and `observe()`, and a registry.

Everything is in the robot's frame (x forward, y left, counter-clockwise, SI units) and clipped to its box.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from reward_model.jit import njit
from socnav_env.config import MAX_WALLS
from socnav_env.frames import closed_lines, lines_between, poses_in_frame, turned_velocities
from socnav_env.layout import FloatArray, IntArray

if TYPE_CHECKING:
    from socnav_env.config import EnvConfig, RoomConfig
    from socnav_env.world import World

Float32Array = NDArray[np.float32]

ENTITY_WIDTHS = {"people": 8, "objects": 6, "walls": 4, "interactions": 4}  # numbers in an entity's row
MAX_SPEED = 5.0  # m/s, bound of the box; nobody in a room is faster
MAX_TURN_RATE = 4 * math.pi  # rad/s, likewise


@runtime_checkable
class Observation(Protocol):
    """What a kind of observation has to offer."""

    def space(self) -> spaces.Space[Any]:
        """Return the space that all observations lie in."""

    def observe(self, world: World, time_left: float) -> Any:
        """Return what the robot sees now, in memory of its own. time_left: share of the episode's time, 0..1."""


@runtime_checkable
class RowObservation(Observation, Protocol):
    """An observation that is a fixed number of numbers, which vector environments have written in place."""

    @property
    def size(self) -> int:
        """How many numbers."""

    def write(self, world: World, time_left: float, row: Float32Array) -> None:
        """Write what the robot sees now into `row`, (size,), all of it."""

    def unpack(self, rows: Float32Array) -> Any:
        """Return, in memory of its own, what was written to one row (size,) or to many, (n, size)."""


class EntitiesObservation:
    """The robot, its goal and everything in the room, as a flat `Dict` of float32 boxes with presence masks.

    robot (4,): forward speed [m/s], speed to the left [m/s], turn rate [rad/s], share of the time that is left
    goal (2,): x, y [m]
    people (max_people * 8,): rows of x, y, cos heading, sin heading, vx, vy (over ground, along the robot's axes),
        turn rate, 1 for somebody who interacts
    objects (max_objects * 6,): rows of x, y, cos heading, sin heading, width, depth
    walls (max_walls * 4,): rows of x1, y1, x2, y2
    interactions (max_interactions * 4,): rows of x1, y1, x2, y2 of the two who interact
    people_mask, objects_mask, walls_mask, interactions_mask: 1 where there is a row, 0 where the row is all zeros

    Rows reshape to (-1, ENTITY_WIDTHS[name]). There are as many as the config can ask for; of more than that (in a
    layout from elsewhere) those with the nearest first point are seen.
    """

    def __init__(self, config: EnvConfig) -> None:
        population, sight = config.population, longest_sight(config.room)
        place, unit, share = [(-sight, sight)] * 2, [(-1.0, 1.0)] * 2, [(0.0, 1.0)]
        motion = [(-MAX_SPEED, MAX_SPEED)] * 2 + [(-MAX_TURN_RATE, MAX_TURN_RATE)]
        entities = {
            "people": (population.max_people, place + unit + motion + share),
            "objects": (population.max_objects, place + unit + [(0.0, sight)] * 2),
            "walls": (MAX_WALLS, place + place),
            "interactions": (population.max_interactions, place + place),
        }
        bounds = {"robot": motion + share, "goal": place}
        for name, (capacity, row) in entities.items():
            bounds[name], bounds[f"{name}_mask"] = row * capacity, share * capacity
        self.capacities = {name: capacity for name, (capacity, _) in entities.items()}
        self.size = sum(len(part) for part in bounds.values())
        pairs = [pair for part in bounds.values() for pair in part]
        self._low, self._high = np.array(list(zip(*pairs, strict=True)), dtype=np.float32)
        ends = np.cumsum([0, *(len(part) for part in bounds.values())])
        self._slices = {name: slice(*pair) for name, pair in zip(bounds, pairwise(ends.tolist()), strict=True)}
        self._starts, self._limits = ends[:-1], np.array(list(self.capacities.values()))

    def space(self) -> spaces.Dict:
        """Return the boxes; a kind of entity that the config rules out has none."""
        return spaces.Dict(
            {
                name: spaces.Box(self._low[part], self._high[part], dtype=np.float32)
                for name, part in self._slices.items()
                if part.stop > part.start
            }
        )

    def observe(self, world: World, time_left: float) -> dict[str, Float32Array]:
        """Return the boxes' values, in memory of their own."""
        row = np.empty(self.size, dtype=np.float32)
        self.write(world, time_left, row)
        return self._parts(row)

    def write(self, world: World, time_left: float, row: Float32Array) -> None:
        """Write the boxes' values one after the other."""
        layout = world.layout
        _write_entities(
            row,
            self._starts,
            self._limits,
            world.robot_pose,
            world.robot_velocity,
            time_left,
            layout.goal,
            world.people_poses,
            world.people_velocities,
            layout.object_poses,
            layout.object_sizes,
            layout.room.corners,
            layout.interaction_pairs,
        )
        _clip(row, self._low, self._high)

    def unpack(self, rows: Float32Array) -> dict[str, Float32Array]:
        """Return the boxes' values, of one row or of many, in memory of their own."""
        return {name: values.copy() for name, values in self._parts(rows).items()}

    def _parts(self, rows: Float32Array) -> dict[str, Float32Array]:
        return {name: rows[..., part] for name, part in self._slices.items() if part.stop > part.start}


OBSERVATIONS: dict[str, Callable[[EnvConfig], Observation]] = {"entities": EntitiesObservation}


def make_observation(observation: str | Observation, config: EnvConfig) -> Observation:
    """Return the observation of this name, or the given one if it is an `Observation` already.

    Raises `ValueError` for a name that nobody goes by and for an object that is not an observation.
    """
    if isinstance(observation, str):
        if observation not in OBSERVATIONS:
            valid = ", ".join(OBSERVATIONS)
            raise ValueError(f"observation must be one of {valid} or an Observation object, got {observation!r}")
        return OBSERVATIONS[observation](config)
    if not isinstance(observation, Observation):
        raise ValueError(
            f"observation must be one of {', '.join(OBSERVATIONS)} or an object with space() and "
            f"observe(world, time_left), got {type(observation).__name__}"
        )
    return observation


def longest_sight(room: RoomConfig) -> float:
    """[m] no two points of a room that the config allows are further apart."""
    side = max(room.square_side[1], room.rectangle_side[1], 3 * room.l_unit[1])
    return math.sqrt(2) * side


@njit
def _write_entities(
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
    _write_robot(row[starts[0] :], frame, velocity, time_left)
    _write_points(row[starts[1] : starts[1] + 2], frame, goal)
    chosen = _nearest(people, frame, capacities[0])
    _write_people(_rows(row, starts, 2, len(chosen), 8), frame, people, people_velocities, pairs, chosen)
    chosen = _nearest(objects, frame, capacities[1])
    _write_objects(_rows(row, starts, 4, len(chosen), 6), frame, objects, sizes, chosen)
    walls = closed_lines(corners)
    chosen = _nearest(walls, frame, capacities[2])
    _write_points(_rows(row, starts, 6, len(chosen), 4), frame, walls[chosen])
    links = lines_between(pairs, people, objects)
    chosen = _nearest(links, frame, capacities[3])
    _write_points(_rows(row, starts, 8, len(chosen), 4), frame, links[chosen])


@njit
def _nearest(places: FloatArray, frame: FloatArray, capacity: int) -> IntArray:
    """Which of the entities get rows: all, or the nearest where there are too many, in their order."""
    if len(places) <= capacity:
        return np.arange(len(places))
    distances = np.hypot(places[:, 0] - frame[0], places[:, 1] - frame[1])
    nearest: IntArray = np.sort(np.argsort(distances, kind="mergesort")[:capacity])  # a stable sort
    return nearest


@njit
def _rows(row: Float32Array, starts: IntArray, part: int, count: int, width: int) -> Float32Array:
    """Mark rows as present, in the part after theirs, and return them to be written, (count, width)."""
    row[starts[part + 1] : starts[part + 1] + count] = 1.0
    return row[starts[part] : starts[part] + count * width].reshape(count, width)


@njit
def _clip(values: Float32Array, low: Float32Array, high: Float32Array) -> None:
    for index in range(len(values)):
        if values[index] < low[index]:
            values[index] = low[index]
        elif values[index] > high[index]:
            values[index] = high[index]


@njit
def _write_robot(row: Float32Array, frame: FloatArray, velocity: FloatArray, time_left: float) -> None:
    cosine, sine = math.cos(frame[2]), math.sin(frame[2])
    row[0] = cosine * velocity[0] + sine * velocity[1]
    row[1] = cosine * velocity[1] - sine * velocity[0]
    row[2] = velocity[2]
    row[3] = time_left


@njit
def _write_points(rows: Float32Array, frame: FloatArray, points: FloatArray) -> None:
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
