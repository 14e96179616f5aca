from dataclasses import replace

import numpy as np
import pytest
import torch

from reward_model.fast.from_checkpoint import compiled_star
from reward_model.graph.windows import frame_graph, mirrored_frame, wall_segments
from reward_model.networks.checkpoint import Checkpoint
from reward_model.networks.registry import StarConfig
from reward_model.networks.star import StarNetwork
from tests.reward_model.random_scenes import random_sequence, random_windows


def trained(rounds: tuple[int, ...], members: int) -> tuple[StarNetwork, Checkpoint]:
    """A network whose batch normalisations have seen some windows, and its checkpoint."""
    windows = random_windows(2, 20)
    with torch.random.fork_rng():
        torch.manual_seed(1)
        network = StarNetwork((42, *rounds, 2), members)
    network.prepare(windows)
    with torch.no_grad():
        for _ in range(10):
            network.train().training_answers(windows)
    for name, tensor in network.state_dict().items():
        if name.endswith("norm.weight"):
            tensor.uniform_(0.5, 1.5)
        elif name.endswith("norm.bias"):
            tensor.uniform_(-0.5, 0.5)
    return network.eval(), Checkpoint(StarConfig((42, *rounds, 2), members), network.state_dict(), {})


@pytest.mark.parametrize(("rounds", "members"), [((16, 16), 2), ((8,), 1), ((10, 7, 21), 3)])
def test_compiled_scores_are_those_of_the_definition(rounds, members):
    network, checkpoint = trained(rounds, members)
    windows = random_windows(3, 70)  # more than one batch
    with torch.no_grad():
        expected = network.scores_and_deviations(windows).numpy()
    found = compiled_star(checkpoint)(windows)[:, :4]
    np.testing.assert_allclose(found, expected, atol=2e-6)
    assert bool(expected[:, 2:].max() > 1e-3) is (members > 1)


def test_a_score_depends_on_its_window_alone_and_not_on_its_side():
    compiled = compiled_star(trained((16, 16), 2)[1])
    windows = random_windows(4, 9)
    together = compiled(windows)
    np.testing.assert_array_equal(np.concatenate([compiled([window]) for window in windows]), together)
    images = compiled([[mirrored_frame(frame) for frame in window] for window in windows])
    np.testing.assert_array_equal(images, together)


def test_a_room_without_anything_has_a_score():
    network, checkpoint = trained((8,), 1)
    compiled = compiled_star(checkpoint)
    window = random_windows(5, 1)[0]
    arrays = window[0].arrays
    kept = np.isin(arrays.kinds, (2, 4))  # the room and the goal
    nothing = np.zeros(0, dtype=np.int32)
    empty = window[0].replaced(
        features=arrays.features[kept],
        kinds=arrays.kinds[kept],
        keys=arrays.keys[kept],
        lengths=arrays.lengths[kept],
        link_sources=nothing,
        link_targets=nothing,
        link_relations=nothing,
        link_lengths=nothing.astype(np.float32),
    )
    with torch.no_grad():
        expected = network.scores_and_deviations([[empty]]).numpy()
    np.testing.assert_allclose(compiled([[empty]])[:, :4], expected, atol=2e-6)
    np.testing.assert_array_equal(compiled([[mirrored_frame(empty)]]), compiled([[empty]]))


def test_the_order_of_very_many_segments_says_nothing():
    compiled = compiled_star(trained((16, 16), 1)[1])
    sequence = random_sequence(np.random.default_rng(6), 1)
    snapshot = sequence.last
    places = np.random.default_rng(7).uniform(-60, 60, (100, 4))
    scores = [
        compiled([[frame_graph(replace(snapshot, walls=walls), wall_segments(walls))]])
        for walls in (places, places[::-1].copy(), places[:, [2, 3, 0, 1]].copy())
    ]
    np.testing.assert_allclose(scores[1], scores[0], atol=1e-6)
    np.testing.assert_allclose(scores[2], scores[0], atol=1e-6)
