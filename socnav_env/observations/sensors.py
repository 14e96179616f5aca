"""The robot's sensors: visibility of people and objects, and noise."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reward_model.base.arrays import BoolArray, FloatArray, IntArray
from socnav_env.geometry.rays import in_view

if TYPE_CHECKING:
    from socnav_env.config.sensors import SensorConfig
    from socnav_env.simulation.world import World


class Sight(NamedTuple):
    """Observed people, objects and interactions, in the world frame; see `Layout` and `World`.

    Attributes:
        interaction_pairs: indices of observed entities, people first
    """

    people_poses: FloatArray
    people_velocities: FloatArray
    object_poses: FloatArray
    object_sizes: FloatArray
    interaction_pairs: IntArray


def look(world: World, sensors: SensorConfig) -> Sight:
    """The current observation. Repeated calls at the same time give the same result."""
    layout = world.layout
    sight = Sight(
        world.state.people_poses,
        world.state.people_velocities,
        layout.object_poses,
        layout.object_sizes,
        world.interactions.pairs,
    )
    seen = _in_view(world, sensors) if sensors.is_limited else None
    if sensors.is_noisy:
        sight = _with_noise(sight, sensors, noise_generator(world))
    return sight if seen is None else _observed(sight, seen)


def noise_generator(world: World) -> np.random.Generator:
    """A generator for sensor noise, which depends on the episode's random state and the time alone.

    The world's own generator is not used, so that the simulation does not depend on observations.
    """
    step = round((world.time + world.config.warm_up) / world.config.control_period)
    key = int(world.random_state["state"]["state"])
    return np.random.Generator(np.random.Philox(key=key, counter=step << 192))


def _in_view(world: World, sensors: SensorConfig) -> BoolArray:
    """(num_people + num_objects,) whether each is within the limits of the sensors."""
    places = np.concatenate([world.people_poses, world.layout.object_poses])
    longest = np.inf if sensors.max_range is None else sensors.max_range
    return in_view(world.robot_pose, places, sensors.field_of_view, longest, sensors.occlusion, *world.obstacles())


def _with_noise(sight: Sight, sensors: SensorConfig, random: np.random.Generator) -> Sight:
    """Add noise to all entities, in view or not, so that an error does not depend on which others are observed."""
    pose_errors = np.array([sensors.position_noise, sensors.position_noise, sensors.heading_noise])
    velocity_errors = np.array([sensors.velocity_noise, sensors.velocity_noise, 0.0])
    people, objects = sight.people_poses, sight.object_poses
    return sight._replace(
        people_poses=people + random.standard_normal(people.shape) * pose_errors,
        people_velocities=sight.people_velocities + random.standard_normal(people.shape) * velocity_errors,
        object_poses=objects + random.standard_normal(objects.shape) * pose_errors,
    )


def _observed(sight: Sight, seen: BoolArray) -> Sight:
    people, objects = np.split(seen, [len(sight.people_poses)])
    pairs, new_index = sight.interaction_pairs, np.cumsum(seen) - 1
    return Sight(
        sight.people_poses[people],
        sight.people_velocities[people],
        sight.object_poses[objects],
        sight.object_sizes[objects],
        new_index[pairs[seen[pairs].all(axis=1)]],
    )
