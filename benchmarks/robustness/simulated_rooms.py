"""Scenes from simulated rooms of 3 to 20 m with up to 30 people, and the same with the robot against something.

Robots drive as in the training data, at up to 1 m/s. One simulation gives many scenes: those of its moments.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from reward_model.analysis.heatmap import placed
from reward_model.base.arrays import FloatArray
from reward_model.scenes.poses import placed_at, rotated
from reward_model.scenes.scene import SceneSequence, Snapshot
from socnav_env.config import ROOM_KINDS, EnvConfig, PopulationConfig, RobotConfig, RoomConfig
from socnav_env.episode import STANDING
from socnav_env.scenes.population import sample_layout
from socnav_env.simulated_data.drivers import DRIVERS
from socnav_env.simulation.snapshots import Recorder
from socnav_env.simulation.world import World

_STEPS = 40  # control periods of a simulation, 8 s
_SNAPSHOTS = 12  # of a scene at most, slightly more than its window
_TOP_SPEED = 1.0  # m/s
_SIDES = (3, 20)  # m
_MOST_PEOPLE = 30
_SPACE = 2.0  # m^2 a person
_ROBOT_AND_PERSON = 0.5  # m between their centres when they touch
_ROBOT = 0.25  # m, radius
_GAPS = (-0.25, 0.3)  # m between surfaces of the robot and of what it is put against


def room_scene(seed: int, room: int, rng: np.random.Generator) -> SceneSequence:
    """A moment of a simulated room: up to 12 snapshots, sometimes one to three only."""
    snapshots = _simulated(seed, room)
    end = int(rng.integers(1, len(snapshots) + 1))
    count = _SNAPSHOTS if rng.random() < 0.8 else int(rng.integers(1, 4))
    return SceneSequence(snapshots[max(0, end - count) : end], f"room {room}")


def contact_scene(seed: int, room: int, rng: np.random.Generator) -> SceneSequence:
    """The same with the robot next to, on the surface of, or in a person, an object or a wall."""
    scene = room_scene(seed, room, rng)
    return placed(scene, _against(scene.last, rng))


@lru_cache(maxsize=2)
def _simulated(seed: int, room: int) -> tuple[Snapshot, ...]:
    """The snapshots of one simulation."""
    rng = np.random.default_rng([seed, room, _STEPS])
    config = _config(rng)
    world = World(sample_layout(config, rng), config, rng)
    recorder = Recorder(world, config.control_period)
    driver = DRIVERS[str(rng.choice(list(DRIVERS)))](rng)
    snapshots = [recorder.snapshots[-1]]
    for step in range(_STEPS):
        world.advance(STANDING if step < config.warm_up_steps else driver.command(world, rng))
        recorder.record()
        snapshots.append(recorder.snapshots[-1])
    return tuple(snapshots)


def _config(rng: np.random.Generator) -> EnvConfig:
    """A room of one size, and as many people as fit into it at most."""
    kind = str(rng.choice(ROOM_KINDS))
    short, long = sorted(int(side) for side in rng.integers(_SIDES[0], _SIDES[1] + 1, 2))
    unit = max(1, short // 3)
    area = {"square": short**2, "rectangle": short * long, "l_shape": 7 * unit**2}[kind]
    most = min(_MOST_PEOPLE, int(area / _SPACE) - 3)
    people = int(rng.integers(0, max(0, most) + 1))
    still = int(rng.integers(0, people + 1))
    few = (0, min(3, int(area) // 20))
    return EnvConfig(
        room=RoomConfig((kind,), (), (short, short), (short, long), (unit, unit)),
        # The most only: where they do not fit, fewer are drawn.
        population=PopulationConfig((0, still), (0, people - still), tables=few, plants=few, interactions=few),
        robot=RobotConfig(max_forward_speed=_TOP_SPEED, max_backward_speed=_TOP_SPEED, min_goal_distance=0.6),
    )


def _against(snapshot: Snapshot, rng: np.random.Generator) -> FloatArray:
    """A position (2,) [m] of the robot at, on or in something, in its present frame."""
    people, objects, walls = snapshot.people.poses, snapshot.objects, snapshot.walls
    kinds = [name for name, there in (("person", people), ("object", objects.poses), ("wall", walls)) if len(there)]
    kind = rng.choice(kinds)
    gap = 0.0 if rng.random() < 0.2 else rng.uniform(*_GAPS)
    angle = rng.uniform(-np.pi, np.pi)
    direction = np.array([np.cos(angle), np.sin(angle)])
    middle = rng.random() < 0.1
    if kind == "person":
        centre = people[rng.integers(len(people)), :2]
        return np.array(centre if middle else centre + (_ROBOT_AND_PERSON + gap) * direction)
    if kind == "object":
        which = rng.integers(len(objects))
        pose, size = objects.poses[which], objects.sizes[which]
        return np.array(pose[:2] if middle else _at_box(pose, size, _ROBOT + gap, rng))
    x1, y1, x2, y2 = walls[rng.integers(len(walls))]
    along = np.array([x2 - x1, y2 - y1])
    normal = rotated(along / np.hypot(*along), np.pi / 2) * rng.choice([-1, 1])
    return np.array([x1, y1]) + rng.random() * along + (0.0 if middle else _ROBOT + gap) * normal


def _at_box(pose: FloatArray, size: FloatArray, distance: float, rng: np.random.Generator) -> FloatArray:
    """A point (2,) at a distance [m] from one side of a rectangle."""
    point = rng.uniform(-size / 2, size / 2)
    axis, side = rng.integers(2), rng.choice([-1, 1])
    point[axis] = side * (size[axis] / 2 + distance)
    return placed_at(pose, np.array([*point, 0.0]))[:2]
