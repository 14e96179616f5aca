"""Speed of `SocNav2-v0`, and the parts of a step's time."""

from __future__ import annotations

import math
import os
import time
from collections import defaultdict
from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any, Final

import numpy as np
import pymunk
from numpy.typing import NDArray

from benchmarks.figures import Figure
from benchmarks.speed_loops import (
    Seconds,
    make_single,
    make_vector,
    play_single,
    play_vector,
    threads_of_torch,
    timed,
)
from reward_model.base.numba import machine_code, njit
from socnav_env.config import EnvConfig, PopulationConfig
from socnav_env.env import SocNavEnv
from socnav_env.people.social_force import walk
from socnav_env.people.walkers import Habits, Surroundings, Walkers
from socnav_env.rewards import REWARDS
from socnav_env.simulation import snapshots as snapshots_module
from socnav_env.simulation.world import World
from socnav_env.vector import env as vector_module

RATES, PARTS, SHARES, FLOOR, RESETS = "Steps", "Step", "Vector step", "Floor", "Reset"
METHODS: Final = {
    RATES: "steps a second, random actions, resets not counted; all take turns",
    PARTS: "microseconds of a step of one environment with the learned reward; people are timed again by themselves, "
    "physics is what they leave of the call that both are in",
    SHARES: "microseconds of each world's step in a vector environment with the learned reward, whose network uses as "
    "many threads as PyTorch is set to: one here, and one a core, as it has where nobody says otherwise; its row is "
    "what a step waits for it, handing windows over included; sparse, which asks no network, takes turns",
    FLOOR: "microseconds with eight people who walk: pymunk's own steps of a control period, and a whole step with "
    "crowdnav; they take turns",
    RESETS: "milliseconds of a reset with its two seconds of warm-up",
}
SIZES = (1, 4, 16, 64)
CROWD = EnvConfig(population=PopulationConfig(still=(0, 0), wandering=(8, 8), interactions=(0, 0)))


def rates(steps: int, runs: int, sizes: Sequence[int]) -> list[Figure]:
    """Steps a second of one environment and of vectors, by reward; also with processes or threads on all cores."""
    single = {reward: make_single(reward=reward) for reward in REWARDS}
    vectors: dict[str, Any] = {}
    for reward in REWARDS:
        vectors |= {f"{reward}, {size} worlds": make_vector(size, reward=reward) for size in sizes}
    cores = os.cpu_count() or 1
    for size in sizes[-2:]:
        name = f"learned, {size} worlds, {cores} processes"
        vectors[name] = make_vector(size, reward="learned", num_workers=min(cores, size))
    values: dict[str, list[float]] = defaultdict(list)
    for run in range(runs + 1):
        played = {name: play_single(env, steps) for name, env in single.items()}
        played |= {name: play_vector(envs, steps) for name, envs in vectors.items()}
        with threads_of_torch(cores):
            for size in sizes[-2:]:
                name = f"learned, {size} worlds"
                played[f"{name}, {cores} threads"] = play_vector(vectors[name], steps)
        for name, rate in played.items() if run > 0 else ():  # the first run warms up
            values[name].append(rate)
    for envs in vectors.values():
        envs.close()
    return [Figure(RATES, name, "1/s", values[name]) for name in sorted(values)]


def step_parts(steps: int) -> list[Figure]:
    """The time of each part of every step; parts within compiled code are run once more by themselves."""
    environment = SocNavEnv()
    play_single(environment, steps)
    spent: Seconds = defaultdict(float)
    rows: list[Seconds] = []

    def note() -> None:
        if spent["whole step"]:
            spent["people"] = _people_alone(environment)
            rows.append(spent.copy())
        spent.clear()

    with ExitStack() as stack:
        named: tuple[tuple[str, Any, str], ...] = (
            ("world", World, "_simulate"),
            ("graph", snapshots_module, "_frame"),
            ("network", environment.reward.scorer, "score_windows"),
            ("observation", environment.observation, "observe"),
            ("whole step", environment, "step"),
        )
        for part, owner, name in named:
            stack.enter_context(timed(owner, name, part, spent))
        play_single(environment, steps, note)
    for row in rows:
        row["physics"] = row["world"] - row["people"]
        row["all else"] = row["whole step"] - sum(row[part] for part in ("world", "graph", "network", "observation"))
    parts = ("physics", "people", "graph", "network", "observation", "all else", "whole step")
    return [Figure(PARTS, part, "µs", [1e6 * row[part] for row in rows]) for part in parts]


def vector_parts(steps: int, num_envs: int) -> list[Figure]:
    """The cost of the reward in a vector's step, graphs and network, the latter on one core and on all."""
    learned, sparse = make_vector(num_envs, reward="learned"), make_vector(num_envs, reward="sparse")
    play_vector(learned, steps)
    figures = []
    for threads in sorted({1, os.cpu_count() or 1}):
        with threads_of_torch(threads):
            figures += _vector_parts(learned, sparse, steps, f"{threads} threads" if threads > 1 else "one thread")
    return figures


def _vector_parts(learned: Any, sparse: Any, steps: int, threads: str) -> list[Figure]:
    num_envs = learned.num_envs
    rows = _spent_in_turns({"whole step": learned, "sparse": sparse}, -(-steps // num_envs))
    shares = {
        "graph and network of it": [(row["graph"] + row["network"]) / row["whole step"] for row in rows],
        "by which sparse is quicker": [1 - row["sparse"] / row["whole step"] for row in rows],
    }
    return [
        *(
            Figure(SHARES, f"{part}, {threads}", "µs", [1e6 * row[part] / num_envs for row in rows])
            for part in ("graph", "network", "whole step")
        ),
        *(Figure(SHARES, f"{name}, {threads}", "%", [100 * share for share in each]) for name, each in shares.items()),
    ]


def _spent_in_turns(vectors: dict[str, Any], rounds: int) -> list[Seconds]:
    """Seconds of each vector's step, by its name, and of graphs and networks in all of them, round by round."""
    num_envs = next(iter(vectors.values())).num_envs
    spent: Seconds = defaultdict(float)
    rows = []
    for environments in vectors.values():
        environments.reset(seed=0)
    with ExitStack() as stack:
        stack.enter_context(timed(snapshots_module, "_frame", "graph", spent))
        stack.enter_context(timed(vector_module, "judge_all", "network", spent))
        for actions in np.random.default_rng(0).uniform(-1, 1, (rounds, num_envs, 2)):
            spent.clear()
            ended = []
            for name, environments in vectors.items():
                begin = time.perf_counter()
                _, _, terminations, truncations, _ = environments.step(actions)
                spent[name] = time.perf_counter() - begin
                ended.append(terminations | truncations)
            rows.append(spent.copy())
            for environments, mask in zip(vectors.values(), ended, strict=True):
                if mask.any():
                    environments.reset(options={"reset_mask": mask})
    return rows


def floor(steps: int) -> list[Figure]:
    """A whole step beside the pymunk steps in it, which are the least time of any environment on pymunk."""
    environment = make_single(reward="crowdnav", config=CROWD)
    space, bodies = _bare_space()
    bare, whole = [], []
    ended = True
    for step, action in enumerate(np.random.default_rng(0).uniform(-1, 1, (steps, 2)).astype(np.float32)):
        if ended:
            environment.reset(seed=step)
        begin = time.perf_counter()
        _, _, terminated, truncated, _ = environment.step(action)
        middle = time.perf_counter()
        for _ in range(CROWD.substeps):
            space.step(CROWD.physics_step)
        end = time.perf_counter()
        whole.append(1e6 * (middle - begin))
        bare.append(1e6 * (end - middle))
        for index, body in enumerate(bodies):  # people walk in circles that keep apart
            angle = 0.02 * step + index * 2 * math.pi / len(bodies)
            body.velocity = math.cos(angle), math.sin(angle)
        ended = terminated or truncated
    ratio = Figure(FLOOR, "whole step, bare physics = 1", "", [float(np.median(whole) / np.median(bare))])
    return [Figure(FLOOR, "bare physics", "µs", bare), Figure(FLOOR, "whole step", "µs", whole), ratio]


def resets(count: int) -> list[Figure]:
    """The time of a reset: sampling a scene and simulating its warm-up."""
    environment = make_single(reward="learned")
    milliseconds = []
    for seed in range(count + 1):
        begin = time.perf_counter()
        environment.reset(seed=seed)
        milliseconds.append(1000 * (time.perf_counter() - begin))
    return [Figure(RESETS, "learned", "ms", milliseconds[1:])]


def _bare_space() -> tuple[pymunk.Space, list[pymunk.Body]]:
    """A room with a robot and eight people in pymunk, as at the start of a control period."""
    space = pymunk.Space()
    side = 4.0
    corners = [(-side, -side), (side, -side), (side, side), (-side, side)]
    for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
        space.add(pymunk.Segment(space.static_body, start, end, 0.0))
    bodies = []
    for index in range(9):
        body = pymunk.Body(1.0, math.inf)
        body.position = 2.0 * (index % 3 - 1), 2.0 * (index // 3 - 1)
        space.add(body, pymunk.Circle(body, 0.25))
        bodies.append(body)
    return space, bodies


def _people_alone(environment: SocNavEnv) -> float:
    """Seconds to compute the people's motion in a control period from the present state, which is not changed."""
    world = environment.world
    bodies, config = world._physics.bodies, world.config
    walkers = Walkers(*(values.copy() for values in world._walkers))
    velocities = bodies.velocities.copy()
    distance, notice = config.people.stop_distance, config.people.robot_visibility
    people = machine_code(_walk, 0, 0.0, bodies.states, walkers, 0.0, 0.0, world._around, world._habits, velocities)
    begin = time.perf_counter()
    people(
        config.substeps,
        config.physics_step,
        bodies.states,
        walkers,
        distance,
        notice,
        world._around,
        world._habits,
        velocities,
    )
    return time.perf_counter() - begin


@njit
def _walk(
    count: int,
    step: float,
    states: NDArray[np.float64],
    walkers: Walkers,
    stop_distance: float,
    notice: float,
    around: Surroundings,
    habits: Habits,
    velocities: NDArray[np.float64],
) -> None:
    for _ in range(count):
        walk(step, states, walkers, stop_distance, notice, around, habits, velocities)
