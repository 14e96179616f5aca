"""Simulated scenes in the form of SocNav2's samples: 35 snapshots over four seconds with a driven robot.

SONATA's robot was driven by an imperfect policy, and by people with a joystick who added rare situations;
`DRIVER_SHARES` is how often each of our drivers stands in for them. Snapshots are 0.1 or 0.2 s apart, as in the
genuine ones.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from reward_model.scenes.scene import DEFAULT_INTERVAL, Objects, People, SceneSequence, Snapshot
from socnav_env.config import EnvConfig
from socnav_env.episode import STANDING
from socnav_env.geometry.frames import pose_rates
from socnav_env.scenes.population import sample_layout
from socnav_env.simulated_data.drivers import DRIVERS
from socnav_env.simulated_data.wide_range import CROWDED
from socnav_env.simulation.snapshots import Recorder
from socnav_env.simulation.world import World

SNAPSHOTS: Final = 35
PERIOD: Final = 0.1  # s
PERIODS: Final = 40  # from the first snapshot to the last, so that some intervals are twice as long
LONGEST_PRELUDE: Final = 60  # maximum number of driven periods before the first snapshot
HELD: Final = 2  # periods for which a driver, who decides five times a second, holds a command
CROWDED_SHARE: Final = 0.5  # of scenes, with up to as many people and objects as SocNav2's fullest
DRIVER_SHARES: Final = MappingProxyType(
    {
        "goal": 0.2,
        "polite": 0.35,
        "cruiser": 0.05,
        "chaser": 0.1,
        "fugitive": 0.05,
        "reverser": 0.1,
        "joystick": 0.1,
        "stander": 0.05,
    }
)


@dataclass(frozen=True)
class Plan:
    """The settings of a sequence, drawn before it is simulated."""

    driver: str
    crowded: bool


def settings() -> dict[str, Any]:
    """All settings that a sequence depends on, besides its seed and the versions in use, as JSON values."""
    return {
        "snapshots": SNAPSHOTS,
        "duration": PERIOD * PERIODS,
        "drivers": dict(DRIVER_SHARES),
        "crowded_share": CROWDED_SHARE,
        "config": _config(False).to_dict(),
        "crowded_population": _config(True).to_dict()["population"],
    }


def plan_sequence(seed: int, index: int) -> Plan:
    """The driver and the kind of scene of a sequence."""
    return _plan(_generator(seed, index))


def simulate_sequence(seed: int, index: int) -> SceneSequence:
    """Simulate sequence `index` of a seed; the result does not depend on other sequences or the process."""
    rng = _generator(seed, index)
    plan = _plan(rng)
    config = _config(plan.crowded)
    world = World(sample_layout(config, rng), config, rng)
    recorder = Recorder(world, PERIOD)
    driver, command = DRIVERS[plan.driver](rng), STANDING
    prelude = int(rng.integers(LONGEST_PRELUDE + 1))
    chosen = _chosen_periods(rng)
    snapshots: list[Snapshot] = []
    for period in range(-config.warm_up_steps - prelude, PERIODS + 1):
        if period in chosen:
            snapshots.append(recorder.snapshots[-1])
        if period >= -prelude and (period + prelude) % HELD == 0:
            command = driver.command(world, rng)
        world.advance(command)
        recorder.record()
    return _retimed(snapshots, f"{seed}-{index:06}")


def _generator(seed: int, index: int) -> np.random.Generator:
    return np.random.default_rng([seed, index, SNAPSHOTS])  # not the stream of `generate_windows`


def _plan(rng: np.random.Generator) -> Plan:
    driver = rng.choice(list(DRIVER_SHARES), p=list(DRIVER_SHARES.values()))
    return Plan(str(driver), bool(rng.random() < CROWDED_SHARE))


def _chosen_periods(rng: np.random.Generator) -> set[int]:
    """The first period, the last, and as many between as make `SNAPSHOTS`, no two adjacent ones left out."""
    num_left_out = PERIODS + 1 - SNAPSHOTS
    apart = np.sort(rng.choice(PERIODS - num_left_out, num_left_out, replace=False))
    return set(range(PERIODS + 1)) - set((1 + apart + np.arange(num_left_out)).tolist())


def _config(crowded: bool) -> EnvConfig:
    return EnvConfig(control_period=PERIOD, population=CROWDED) if crowded else EnvConfig(control_period=PERIOD)


def _retimed(snapshots: list[Snapshot], name: str) -> SceneSequence:
    """The snapshots as a recording that begins at 0 s; velocities are those since the previous snapshot."""
    start, earlier = snapshots[0].timestamp, snapshots[0]
    retimed: list[Snapshot] = []
    for now in snapshots:
        elapsed = now.timestamp - earlier.timestamp
        interval = elapsed if retimed else DEFAULT_INTERVAL
        people, objects = now.people, now.objects
        retimed.append(
            replace(
                now,
                timestamp=round(now.timestamp - start, 6),
                interval=interval,
                people=People(people.ids, people.poses, pose_rates(earlier.people.poses, people.poses, interval)),
                objects=Objects(
                    objects.ids,
                    objects.poses,
                    pose_rates(earlier.objects.poses, objects.poses, interval),
                    objects.sizes,
                ),
            )
        )
        earlier = now
    return SceneSequence(tuple(retimed), name)
