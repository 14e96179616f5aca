"""Scenes drawn at random: any of them is valid, none of them need look like a room with people in it."""

import numpy as np

from reward_model.graph.frame import FrameGraph
from reward_model.graph.windows import sequence_frames
from reward_model.scenes.scene import Interactions, Objects, People, SceneSequence, Snapshot


def random_snapshot(
    rng: np.random.Generator,
    timestamp: float,
    people_ids: list[int],
    object_ids: list[int],
    walls: np.ndarray,
) -> Snapshot:
    """Everyone somewhere within 4 m; half of the people interact with the next person or object."""
    everyone = [*people_ids, *object_ids]
    pairs = [(person, everyone[index + 1]) for index, person in enumerate(people_ids[: len(everyone) - 1])][::2]

    def around(count: int) -> np.ndarray:
        return rng.uniform((-4, -4, -np.pi), (4, 4, np.pi), (count, 3))

    return Snapshot(
        timestamp=timestamp,
        interval=0.2,
        command=rng.uniform((-0.4, 0, -0.4), (0.4, 1e-9, 0.4)),
        goal=rng.uniform(-4, 4, 2),
        people=People(np.array(people_ids, dtype=np.int64), around(len(people_ids)), around(len(people_ids)) / 5),
        objects=Objects(
            np.array(object_ids, dtype=np.int64),
            around(len(object_ids)),
            around(len(object_ids)) / 5,
            rng.uniform(0.2, 1, (len(object_ids), 2)),
        ),
        walls=walls,
        interactions=Interactions(np.array(pairs, dtype=np.int64).reshape(-1, 2), ("together",) * len(pairs)),
    )


def random_sequence(
    rng: np.random.Generator,
    num_frames: int = 3,
    num_people: int = 3,
    num_objects: int = 2,
    come_and_go: bool = False,
) -> SceneSequence:
    """Snapshots 1 s apart, so that each is a frame of the window. Who comes and goes is left out of one of them."""
    half_length, half_width = rng.uniform(2, 5, 2)
    x, y = half_length * np.array([-1, 1, 1, -1]), half_width * np.array([-1, -1, 1, 1])
    walls = np.column_stack([x, y, np.roll(x, -1), np.roll(y, -1)])
    snapshots = []
    for index in range(num_frames):
        people = list(range(1, num_people + 1))
        if come_and_go:
            del people[index % num_people]
        objects = list(range(101, 101 + num_objects))
        snapshots.append(random_snapshot(rng, float(index), people, objects, walls))
    return SceneSequence(tuple(snapshots))


def random_windows(seed: int, count: int = 6) -> list[list[FrameGraph]]:
    """Windows of one, two and three frames in turn, with different crowds; in every second one, people come and go."""
    rng = np.random.default_rng(seed)
    sequences = [
        random_sequence(rng, 1 + index % 3, int(rng.integers(1, 6)), int(rng.integers(0, 4)), index % 2 == 1)
        for index in range(count)
    ]
    return [sequence_frames(sequence) for sequence in sequences]
