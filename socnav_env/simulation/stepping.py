"""Compiled physics steps of a world: people walk, the robot drives, bodies move."""

from __future__ import annotations

import math

import numpy as np

from reward_model.base.angles import wrap_heading
from reward_model.base.arrays import FloatArray, IntArray
from reward_model.base.numba import njit
from socnav_env.people.social_force import walk
from socnav_env.people.walkers import Habits, Surroundings, Walkers
from socnav_env.simulation.motors import Motion, approach
from socnav_env.simulation.physics import Bodies, physics_step


@njit
def simulate(
    count: int,
    step: float,
    bodies: Bodies,
    motion: Motion,
    walkers: Walkers,
    stop_distance: float,
    notice: float,
    around: Surroundings,
    habits: Habits,
) -> None:
    """Simulate `count` physics steps of `step` seconds; see `walk` for the arguments about people."""
    for _ in range(count):
        walk(step, bodies.states, walkers, stop_distance, notice, around, habits, bodies.velocities)
        move(step, bodies, motion)


@njit
def move(step: float, bodies: Bodies, motion: Motion) -> None:
    """Simulate a physics step, with the robot driven by its motors and people walking."""
    _drive(step, bodies, motion)
    physics_step(bodies, step)


@njit
def _drive(step: float, bodies: Bodies, motion: Motion) -> None:
    """Set the robot's velocity: along its heading halfway through the step, zero once it touches something."""
    if bodies.touched.any():
        motion.velocity[:] = 0.0
        bodies.velocities[-1] = 0.0
        return
    approach(motion, step)
    forward, left, turn_rate = motion.velocity
    heading = bodies.states[-1, 2] + turn_rate * step / 2
    cosine, sine = math.cos(heading), math.sin(heading)
    velocity = bodies.velocities[-1]
    velocity[0], velocity[1], velocity[2] = forward * cosine - left * sine, forward * sine + left * cosine, turn_rate


@njit
def state_of(
    bodies: FloatArray, before: FloatArray, walkers: IntArray, standing: FloatArray, period: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """The robot's pose and velocity, (3,), and people's, (num_people, 3).

    Args:
        bodies: (num_walkers + 1, 6) as in pymunk, the robot last
        before: (num_walkers + 1, 3) a period ago
        walkers: (num_walkers,) index of each walker
        standing: (num_people, 3) poses of the others
    """
    poses, velocities = standing.copy(), np.zeros_like(standing)
    for row in range(len(walkers)):
        poses[walkers[row]] = bodies[row, :3]
        velocities[walkers[row]] = (bodies[row, :3] - before[row]) / period
        poses[walkers[row], 2] = wrap_heading(bodies[row, 2])
    pose, velocity = bodies[-1, :3].copy(), (bodies[-1, :3] - before[-1]) / period
    pose[2] = wrap_heading(pose[2])
    return pose, velocity, poses, velocities
