import numpy as np
import pytest

from reward_model.fast.grouped_window import FEATURES, GROUPED, KINDS, MANY_TO_ONE, flat_windows
from reward_model.graph.features import NodeKind, Relation
from reward_model.graph.frame import stack_windows
from reward_model.graph.windows import frame_graph, scene_graph, wall_segments
from reward_model.scenes.scene import People
from tests.reward_model.graph.test_windows import NO_INTERACTIONS, hand_made, interactions, objects, people
from tests.reward_model.random_scenes import random_windows

WALL = np.array([[0.0, 2.0, 1.0, 2.0]])  # two segments


def frame(someone, **changes):
    scene = hand_made(people=someone, walls=WALL, **{"objects": objects(), "interactions": NO_INTERACTIONS} | changes)
    return frame_graph(scene, wall_segments(scene.walls))


def groups_of(edges):
    """(relation, centre, others) of every group."""
    relations = [GROUPED[row] for row, bounds in enumerate(edges.bounds) for _ in range(bounds[-1] - bounds[0])]
    ends = zip(edges.starts[:-1], edges.starts[1:], strict=True)
    others = [edges.others[first:last].tolist() for first, last in ends]
    return [(Relation(r).name, c, o) for r, c, o in zip(relations, edges.centres.tolist(), others, strict=True)]


def test_nodes_stand_by_place_then_kind_then_window():
    two, one = frame(people((3, -3), (3, 3))), frame(people((3, -3)), objects=objects((1, -3)))
    nodes, _ = flat_windows(stack_windows([[two, one], [one]]))
    # of the first window and the second: rooms, people, objects, segments, goals
    newest, older, oldest = [1, 1, 2, 1, 0, 1, 2, 2, 1, 1], [1, 0, 1, 0, 1, 0, 2, 0, 1, 0], [0] * 10
    assert np.diff(nodes.starts).tolist() == newest + older + oldest
    assert [KINDS.index(kind) for kind in (NodeKind.ROOM, NodeKind.GOAL)] == [0, 4]
    flags = nodes.features[:, :4].astype(int).tolist()  # the kind, and the places in the window
    assert flags == [[1, 1, 0, 0]] * 12 + [[1, 0, 1, 0]] * 6
    # the room, person 1, the segments and the goal are in both frames of the first window
    assert nodes.older.tolist() == [12, -1, 13, -1, -1, -1, 15, 16, -1, -1, 17, -1] + [-1] * 6
    assert nodes.newer.tolist() == [-1] * 12 + [0, 2, -1, 6, 7, 10]


def test_edges_stand_together_by_what_is_computed_once():
    crowd = frame(
        people((0.25, 1.0), (3.0, -3.0), (0.0, 2.5)),  # persons 1 and 3 are near both segments
        objects=objects((1.0, -3.0)),
        interactions=interactions((1, 2), (1, 3), (2, 101)),
    )
    _, edges = flat_windows(stack_windows([[crowd]]))
    # nodes: the room, persons at 1 to 3, the object at 4, segments at 5 and 6, the goal
    assert groups_of(edges) == [
        ("PERSON_ROOM", 0, [1, 2, 3]),
        ("OBJECT_ROOM", 0, [4]),
        ("WALL_ROOM", 0, [5, 6]),
        ("GOAL_ROOM", 0, [7]),
        ("WALL_PERSON", 1, [5, 6]),
        ("WALL_PERSON", 3, [5, 6]),
        ("ROOM_PERSON", 0, [1, 2, 3]),
        ("ROOM_OBJECT", 0, [4]),
        ("ROOM_WALL", 0, [5, 6]),
        ("ROOM_GOAL", 0, [7]),
        ("OBJECT_PERSON", 4, [2]),
        ("PERSON_OBJECT", 2, [4]),
        ("PERSON_PERSON", 1, [2]),
        ("PERSON_PERSON", 2, [1]),
        ("PERSON_PERSON", 1, [3]),
        ("PERSON_PERSON", 3, [1]),
        ("PERSON_WALL", 1, [5, 6]),
        ("PERSON_WALL", 3, [5, 6]),
    ]


def test_bounds_tell_the_places_apart():
    empty, near = frame(people()), frame(people((0.25, 1.0)))
    _, edges = flat_windows(stack_windows([[near, empty, near], [empty, near]]))
    bounds = dict(zip(GROUPED, edges.bounds.tolist(), strict=True))
    starts = {relation: [place - row[0] for place in row] for relation, row in bounds.items()}
    assert starts[Relation.GOAL_ROOM] == [0, 2, 4, 5]
    assert starts[Relation.OBJECT_ROOM] == [0, 0, 0, 0]
    assert starts[Relation.PERSON_ROOM] == starts[Relation.WALL_PERSON] == [0, 1, 2, 3]


@pytest.mark.parametrize("seed", range(3))
def test_nothing_of_the_graphs_is_lost(seed):
    """Window by window: every edge with its length, every feature, and the number of edges into each node."""
    for window in random_windows(40 + seed, count=6):
        graph = scene_graph(window)
        nodes, edges = flat_windows(stack_windows([window]))
        place = place_of_nodes(window)
        np.testing.assert_allclose(1 / nodes.inverse_degrees[place], np.bincount(graph.targets), rtol=1e-6)
        kinds = np.concatenate([each.arrays.kinds for each in window])
        features = np.zeros_like(graph.features)
        for node, kind in enumerate(kinds):
            columns = FEATURES[KINDS.index(NodeKind(kind))]
            features[node, list(columns)] = nodes.features[place[node], : len(columns)]
        np.testing.assert_array_equal(features, graph.features)
        found = set(zip(*flat_edges(edges), strict=True))
        kept = np.isin(graph.relations, GROUPED)
        ends = place[graph.sources[kept]], place[graph.targets[kept]]
        columns = (graph.relations[kept], *ends, graph.lengths[kept])
        expected = set(zip(*(column.tolist() for column in columns), strict=True))
        assert found == expected
        assert len(edges.others) == kept.sum()
        to_older = np.isin(graph.relations, (Relation.NOW_TO_SECOND, Relation.SECOND_TO_THIRD))
        pairs = set(zip(place[graph.sources[to_older]].tolist(), place[graph.targets[to_older]].tolist(), strict=True))
        assert {(node, older) for node, older in enumerate(nodes.older.tolist()) if older >= 0} == pairs
        assert {(newer, node) for node, newer in enumerate(nodes.newer.tolist()) if newer >= 0} == pairs


def test_entities_are_found_in_older_frames_whoever_left_or_came():
    crowd = people((3, -3), (3, 3), (-3, 3))
    others = [People(crowd.ids[kept], crowd.poses[kept], crowd.velocities[kept]) for kept in ([1, 2], [2, 0, 1])]
    newest, second = frame(crowd), frame(others[0])
    nodes, _ = flat_windows(stack_windows([[newest, second]]))
    # room, three people, two segments, goal; then room, two people, two segments, goal
    assert nodes.older.tolist() == [7, -1, 8, 9, 10, 11, 12, *[-1] * 6]
    assert nodes.newer.tolist() == [*[-1] * 7, 0, 2, 3, 4, 5, 6]
    nodes, _ = flat_windows(stack_windows([[newest, frame(others[1])]]))
    assert nodes.older.tolist() == [7, 9, 10, 8, 11, 12, 13, *[-1] * 7]


def place_of_nodes(window):
    """The places of the nodes of a window's graph, sorted by place in the window and kind, else in their order."""
    keys = [(time, KINDS.index(NodeKind(kind))) for time, each in enumerate(window) for kind in each.arrays.kinds]
    order = sorted(range(len(keys)), key=keys.__getitem__)
    return np.argsort(order)


def flat_edges(edges):
    """Columns: relation, source, target, length."""
    groups = groups_of(edges)
    counts = [len(others) for _, _, others in groups]
    names = np.repeat([name for name, _, _ in groups], counts)
    centres = np.repeat([centre for _, centre, _ in groups], counts)
    many_to_one = np.isin(names, [relation.name for relation in MANY_TO_ONE])
    sources, targets = np.where(many_to_one, edges.others, centres), np.where(many_to_one, centres, edges.others)
    return [Relation[name].value for name in names], sources.tolist(), targets.tolist(), edges.lengths.tolist()
