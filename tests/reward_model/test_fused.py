import numpy as np
import pytest
import torch

from reward_model.compiled import propagate
from reward_model.flat_window import flat_window
from reward_model.fused import FusedMPNN, _apply_elu
from reward_model.graph import Relation, frame_graph, scene_graph, wall_segments
from reward_model.models.edge_networks import EDGE_NETWORKS
from reward_model.windows import pack_windows
from tests.reward_model.random_scenes import random_windows
from tests.reward_model.test_compiled import SIZES, random_network, random_operators
from tests.reward_model.test_graph import hand_made, interactions, objects, people


@pytest.mark.parametrize("edge_network", sorted(EDGE_NETWORKS))
@pytest.mark.parametrize("sizes", SIZES)
def test_answers_are_those_of_the_padded_network(sizes, edge_network):
    windows = random_windows(20 + len(sizes), count=12)
    operators = random_operators(sizes, edge_network)
    fused = FusedMPNN(operators)
    with torch.no_grad():
        expected = torch.relu(propagate(pack_windows(windows), operators)).numpy()
    answers = fused(windows)
    assert answers.dtype == np.float32
    np.testing.assert_allclose(answers, expected, atol=1e-5, rtol=1e-5)


def test_the_same_window_gives_the_same_bits_whatever_came_before():
    windows = random_windows(31, count=6)
    fused = FusedMPNN(random_network((42, 8, 6, 2), "tabulated").operators())
    first = [fused([window]).tobytes() for window in windows]
    second = [row.tobytes() for row in fused(windows[::-1])]
    assert first == second[::-1]


@pytest.mark.parametrize("num_threads", [2, 3])
def test_threads_change_nothing(monkeypatch, num_threads):
    windows = random_windows(35, count=13)
    fused = FusedMPNN(random_network((42, 8, 6, 2), "tabulated").operators())
    alone = fused(windows)
    monkeypatch.setattr(torch, "get_num_threads", lambda: num_threads)
    np.testing.assert_array_equal(fused(windows), alone)
    assert len({row.tobytes() for row in alone}) == 13


def test_elu_is_that_of_pytorch():
    values = np.array([[-100, -16.1, -15.9, -3, -1], [-0.5, -1e-3, -1e-7, -0.0, np.nan], [0, 1e-7, 1, 300, np.inf]])
    values = np.concatenate([values.astype(np.float32), np.linspace(-20, 2, 5000, dtype=np.float32).reshape(-1, 5)])
    expected = torch.nn.functional.elu(torch.from_numpy(values.copy())).numpy()
    _apply_elu(values)
    np.testing.assert_allclose(values, expected, rtol=1e-6, atol=2e-7)


def test_training_on_changes_nothing():
    network = random_network((42, 8, 2), "tabulated")
    window = random_windows(33, count=1)[0]
    fused = FusedMPNN(network.operators())
    before = fused([window])
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.fill_(0.5)
    np.testing.assert_array_equal(fused([window]), before)


def test_frames_are_left_as_they_were():
    window = random_windows(32, count=3)[2]
    before = [frame.features.copy() for frame in window]
    FusedMPNN(random_network((42, 8, 2), "tabulated").operators())([window])
    for frame, features in zip(window, before, strict=True):
        np.testing.assert_array_equal(frame.features, features)


def test_links_stand_together_by_what_is_computed_once():
    scene = hand_made(
        people=people((0.25, 1.0), (3.0, -3.0), (0.0, 2.5)),
        objects=objects((1.0, -3.0)),
        walls=np.array([[0.0, 2.0, 1.0, 2.0]]),  # two segments, both near persons 1 and 3
        interactions=interactions((1, 2), (1, 3), (2, 101)),
    )
    nodes, links = flat_window([frame_graph(scene, wall_segments(scene.walls))])
    groups = [
        (
            Relation(links.relations[first]).name,
            links.sources[first:last].tolist(),
            links.targets[first:last].tolist(),
        )
        for first, last in zip(links.starts[:-1], links.starts[1:], strict=True)
    ]
    # nodes: the room, persons 1 to 3, the object at 4, the goal, segments at 6 and 7
    assert groups == [
        ("PERSON_PERSON", [1, 1], [2, 3]),
        ("PERSON_WALL", [1, 1], [6, 7]),
        ("WALL_PERSON", [6, 7], [1, 1]),
        ("PERSON_OBJECT", [2], [4]),
        ("PERSON_PERSON", [2], [1]),
        ("PERSON_PERSON", [3], [1]),
        ("PERSON_WALL", [3, 3], [6, 7]),
        ("WALL_PERSON", [6, 7], [3, 3]),
        ("OBJECT_PERSON", [4], [2]),
    ]
    assert nodes.starts.tolist() == [0, 8]
    assert nodes.older.tolist() == [-1] * 8


@pytest.mark.parametrize("seed", range(3))
def test_shares_count_the_edges_of_the_graph(seed):
    for window in random_windows(40 + seed, count=6):
        graph = scene_graph(window)
        nodes, _ = flat_window(window)
        np.testing.assert_allclose(1 / nodes.shares, np.bincount(graph.targets), rtol=1e-6)
        np.testing.assert_array_equal(nodes.features, graph.features)
        kept = (graph.relations == Relation.NOW_TO_SECOND) | (graph.relations == Relation.SECOND_TO_THIRD)
        older = np.full(len(nodes.kinds), -1)
        older[graph.sources[kept]] = graph.targets[kept]
        np.testing.assert_array_equal(nodes.older, older)
