"""The bodies of a world and pymunk's space that keeps them apart. Only this module imports pymunk.

A control period has several physics steps, each of which writes and reads all bodies. From Python that takes several
times as long as Chipmunk's own work, so compiled code calls the same Chipmunk functions as `pymunk.Space.step` and
`pymunk.batch`, by their addresses.
"""

from __future__ import annotations

import math
import weakref
from typing import Any, Final, NamedTuple

import numpy as np
import pymunk
from numpy.typing import NDArray
from pymunk._chipmunk_cffi import ffi, lib
from pymunk.batch import BodyFields

from reward_model.base.arrays import BoolArray, FloatArray, IntArray
from reward_model.base.numba import call_with_pointers, call_with_real, njit
from socnav_env.config import EnvConfig
from socnav_env.people.walkers import Surroundings

ROBOT, PERSON, OBJECT, WALL = 1, 2, 3, 4  # pymunk's collision types
BODY_MASS = 1.0  # kg, the same for all: in a contact both give way
SLOP = 0.001  # m by which bodies may overlap at rest
OVERLAP_KEPT = 0.3  # share of an overlap that is left after a physics step
READ: Final = BodyFields.POSITION | BodyFields.ANGLE | BodyFields.VELOCITY | BodyFields.ANGULAR_VELOCITY
WRITE: Final = BodyFields.VELOCITY | BodyFields.ANGULAR_VELOCITY
_STEP, _EACH_BODY, _GET, _SET, _SPACE, _READING, _WRITING = range(7)  # places in `Bodies.addresses`


class Bodies(NamedTuple):
    """The bodies of a space, for compiled code, valid as long as their `Physics` exists; the robot is the last one.

    Attributes:
        states: (num_bodies, 6) x, y, heading, vx, vy, turn rate, read from pymunk after each step
        velocities: (num_bodies, 3) vx, vy, turn rate, to be set before each step
        touched: whether the robot touched a body, by pymunk's collision type; set during a step, never cleared
        addresses: of Chipmunk's functions and of their arguments
        read, written: (1,) Chipmunk's position in its buffers
    """

    states: FloatArray
    velocities: FloatArray
    touched: BoolArray
    addresses: IntArray
    read: NDArray[np.int32]
    written: NDArray[np.int32]


class Physics:
    """The pymunk space: bodies for the robot and those who walk, fixed shapes for all else.

    Args:
        num_walkers: number of people who walk
    """

    def __init__(self, num_walkers: int, config: EnvConfig) -> None:
        self._config = config
        self._space = pymunk.Space()
        self._space.collision_slop = SLOP
        self._space.collision_bias = OVERLAP_KEPT ** (1 / config.physics_step)
        states, velocities = _Exchange(READ, num_walkers + 1, 6), _Exchange(WRITE, num_walkers + 1, 3)
        self._exchanges = states, velocities  # Chipmunk reads and writes their memory
        functions = (
            "cpSpaceStep",
            "cpSpaceEachBody",
            "pmSpaceBodyGetIteratorFuncBatched",
            "pmSpaceBodySetIteratorFuncBatched",
        )
        pointers = [*(ffi.addressof(lib, name) for name in functions), self._space._space, states.data, velocities.data]
        self.bodies = Bodies(
            states=states.rows,
            velocities=velocities.rows,
            touched=np.zeros(WALL + 1, dtype=np.bool_),
            addresses=np.array([int(ffi.cast("intptr_t", pointer)) for pointer in pointers]),
            read=states.progress,
            written=velocities.progress,
        )
        self._report_touches(self.bodies.touched)
        weakref.finalize(self, _free_space, self._space).atexit = False

    def fill(self, groups: IntArray, around: Surroundings) -> None:
        """Add the bodies at `bodies.states`, and everything around them. groups: (num_walkers,)."""
        *walkers, robot = self.bodies.states
        for row, group in zip(walkers, groups, strict=True):
            # People of one group walk shoulder to shoulder: they do not collide with each other.
            self._add_body(row, self._config.people.radius, PERSON, pymunk.ShapeFilter(group=int(group) + 1))
        self._add_body(robot, self._config.robot.radius, ROBOT, pymunk.ShapeFilter())
        self._add_fixed(around)

    def _report_touches(self, touched: BoolArray) -> None:
        def touch(_arbiter: pymunk.Arbiter, _space: pymunk.Space, kind: int) -> None:
            touched[kind] = True

        for kind in (PERSON, OBJECT, WALL):
            self._space.on_collision(ROBOT, kind, post_solve=touch, data=kind)

    def _add_body(self, row: FloatArray, radius: float, kind: int, group: pymunk.ShapeFilter) -> None:
        body = pymunk.Body(BODY_MASS, math.inf)
        body.position = float(row[0]), float(row[1])
        body.angle = float(row[2])
        shape = pymunk.Circle(body, radius)
        shape.collision_type, shape.filter = kind, group
        self._space.add(body, shape)

    def _add_fixed(self, around: Surroundings) -> None:
        fixed = self._space.static_body
        for x1, y1, x2, y2 in around.walls.tolist():
            self._add_shape(pymunk.Segment(fixed, (x1, y1), (x2, y2), 0.0), WALL)
        for x, y, radius in around.discs.tolist():
            self._add_shape(pymunk.Circle(fixed, radius, (x, y)), PERSON)
        for box in around.boxes:
            self._add_shape(pymunk.Poly(fixed, _corners_of(box)), OBJECT)

    def _add_shape(self, shape: pymunk.Shape, kind: int) -> None:
        shape.collision_type = kind
        self._space.add(shape)


class _Exchange:
    """An array that Chipmunk reads or writes, one row per body, like `pymunk.batch.Buffer`.

    rows: (num_bodies, width) the values
    progress: (1,) the number of values exchanged; Chipmunk continues after them
    data: argument of Chipmunk's iterators
    """

    def __init__(self, fields: BodyFields, num_bodies: int, width: int) -> None:
        # One row for pymunk's own fixed body, and one more since Chipmunk moves an array as soon as it is full.
        numbers = np.zeros((num_bodies + 2, width))
        self._array = ffi.new("pmFloatArray *")
        self._array.arr, self._array.max = ffi.cast("double *", numbers.ctypes.data), numbers.size
        self._memory = numbers
        self.rows = numbers[:num_bodies]
        self.progress = np.frombuffer(ffi.buffer(ffi.addressof(self._array, "num")), dtype=np.int32)
        self.data: Any = ffi.new("pmBatchedData *")
        self.data.fields, self.data.floatArray = fields.value, self._array


def _free_space(space: pymunk.Space) -> None:
    """Free a space at once: its parts refer to each other, and Python seldom collects cycles."""
    for part in (*space._handlers.values(), *space.shapes, *space.bodies, space.static_body):
        vars(part).clear()


@njit
def physics_step(bodies: Bodies, duration: float) -> None:
    """Set all velocities, simulate for `duration` [s], and read back the states."""
    addresses = bodies.addresses
    bodies.written[0] = 0
    call_with_pointers(addresses[_EACH_BODY], addresses[_SPACE], addresses[_SET], addresses[_WRITING])
    call_with_real(addresses[_STEP], addresses[_SPACE], duration)
    bodies.read[0] = 0
    call_with_pointers(addresses[_EACH_BODY], addresses[_SPACE], addresses[_GET], addresses[_READING])


def _corners_of(box: FloatArray) -> list[tuple[float, float]]:
    x, y, cos, sin, half_width, half_depth = box.tolist()
    signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return [
        (x + cos * a * half_width - sin * b * half_depth, y + sin * a * half_width + cos * b * half_depth)
        for a, b in signs
    ]
