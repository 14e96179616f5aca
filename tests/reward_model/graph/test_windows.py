from dataclasses import replace

import numpy as np
import pytest

from reward_model.data.augmentation import mirrored
from reward_model.graph.features import NodeKind, Relation
from reward_model.graph.windows import (
    frame_graph,
    matching_nodes,
    mirrored_frame,
    reversed_walls,
    scene_graph,
    select_window,
    sequence_frames,
    wall_segments,
)
from reward_model.scenes.scene import Interactions, Objects, People, ScenarioError, SceneSequence, Snapshot
from tests.reward_model.random_scenes import random_sequence

NO_INTERACTIONS = Interactions(np.zeros((0, 2), dtype=np.int64), ())


def hand_made(**changes) -> Snapshot:
    """One person to the left ahead, who looks left and uses an object on the right; a wall of 1.2 m on the left."""
    snapshot = Snapshot(
        timestamp=0.0,
        interval=0.2,
        command=np.array([0.35, 0.0, 0.2]),
        goal=np.array([4.0, -3.0]),
        people=People(np.array([1]), np.array([[2.0, 1.0, np.pi / 2]]), np.array([[0.5, -0.25, 0.5]])),
        objects=Objects(
            np.array([5]), np.array([[0.0, -3.0, 0.0]]), np.array([[0.0, 0.1, 0.0]]), np.array([[0.5, 0.75]])
        ),
        walls=np.array([[2.0, 2.0, 2.0, 3.2]]),
        interactions=Interactions(np.array([[1, 5]]), ("human_laptop_interaction",)),
    )
    return replace(snapshot, **changes)


def graph_of(snapshot: Snapshot):
    return frame_graph(snapshot, wall_segments(snapshot.walls))


def people(*places, first=1) -> People:
    poses = np.array([(*place, 0.0) for place in places]).reshape(-1, 3)
    return People(np.arange(first, first + len(poses)), poses, np.zeros_like(poses))


def objects(*places) -> Objects:
    poses = np.array([(*place, 0.0) for place in places]).reshape(-1, 3)
    return Objects(np.arange(101, 101 + len(poses)), poses, np.zeros_like(poses), np.ones((len(poses), 2)))


def interactions(*pairs) -> Interactions:
    return Interactions(np.array(pairs, dtype=np.int64).reshape(-1, 2), ("together",) * len(pairs))


# By hand from the published layout: type 5, time 3, person 9, robot 2, object 11, room 2, wall 6, goal 4.
# The data's frame has x to the right and y forward; lengths in decametres.
NO_TYPE, NO_TIME = [0, 0, 0, 0, 0], [0, 0, 0]
NO_PERSON, NO_ROBOT, NO_OBJECT, NO_ROOM, NO_WALL, NO_GOAL = [0] * 9, [0] * 2, [0] * 11, [0] * 2, [0] * 6, [0] * 4
NOW = [1, 0, 0]
# command (adv 9.4 * 0.35 = 3.29, rot -10.32 * 0.2 = -2.064) over (3.5, 4); one person
ROOM = [0, 0, 1, 0, 0, *NOW, *NO_PERSON, 0.94, -0.516, *NO_OBJECT, 1 / 15, 1 / 225, *NO_WALL, *NO_GOAL]
# at (-1, 2) m, a = -pi, displacements of minus (0.05, 0.1) m and minus 0.1 rad
PERSON = [
    *[1, 0, 0, 0, 0, *NOW],
    *[-0.1, 0.2, -0.01, -0.005, -0.01, 0, -1, 0.2236068, 0.7763932],
    *[*NO_ROBOT, *NO_OBJECT, *NO_ROOM, *NO_WALL, *NO_GOAL],
]
# at (3, 0) m, a = -pi/2, minus a displacement of 0.02 m to the left
OBJECT = [
    *[0, 1, 0, 0, 0, *NOW, *NO_PERSON, *NO_ROBOT],
    *[0.3, 0, 0, 0.002, 0, -1, 0, 0.5, 0.75, 0.3, 0.7],
    *[*NO_ROOM, *NO_WALL, *NO_GOAL],
]
GOAL = [0, 0, 0, 0, 1, *NOW, *NO_PERSON, *NO_ROBOT, *NO_OBJECT, *NO_ROOM, *NO_WALL, 0.3, 0.4, 0.5, 0.5]
# two segments with midpoints at (-2.3, 2) m and (-2.9, 2) m, running to the left: o = atan2(-1, 0) = -pi/2
BEFORE_WALL = [0, 0, 0, 1, 0, *NOW, *NO_PERSON, *NO_ROBOT, *NO_OBJECT, *NO_ROOM]
NEAR_WALL = [*BEFORE_WALL, -0.23, 0.2, -1, 0, 0.3047950, 0.6952050, *NO_GOAL]
FAR_WALL = [*BEFORE_WALL, -0.29, 0.2, -1, 0, 0.3522783, 0.6477217, *NO_GOAL]

FRAME_EDGES = {
    (1, 0, "PERSON_ROOM"): 0.2236068,
    (2, 0, "OBJECT_ROOM"): 0.3,
    (3, 0, "GOAL_ROOM"): 0.5,
    (4, 0, "WALL_ROOM"): 0.3047950,
    (5, 0, "WALL_ROOM"): 0.3522783,
    (0, 1, "ROOM_PERSON"): 0.2236068,
    (0, 2, "ROOM_OBJECT"): 0.3,
    (0, 3, "ROOM_GOAL"): 0.5,
    (0, 4, "ROOM_WALL"): 0.3047950,
    (0, 5, "ROOM_WALL"): 0.3522783,
    (1, 2, "PERSON_OBJECT"): 0.4472136,  # dam
    (2, 1, "OBJECT_PERSON"): 0.4472136,
    (1, 4, "PERSON_WALL"): 1.3,  # m; the other segment's midpoint is 1.9 m away
    (4, 1, "WALL_PERSON"): 1.3,
    **{(node, node, "SELF"): 0.0 for node in range(6)},
}


def edges_of(graph) -> dict[tuple[int, int, str], float]:
    """By source, target and relation; fails where two edges share all three."""
    ends = zip(graph.sources.tolist(), graph.targets.tolist(), graph.relations.tolist(), strict=True)
    names = [(source, target, Relation(relation).name) for source, target, relation in ends]
    assert len(set(names)) == len(names)
    return dict(zip(names, graph.lengths.tolist(), strict=True))


def links_of(frame) -> dict[tuple[int, int, str], float]:
    columns = (
        frame.arrays.link_sources,
        frame.arrays.link_targets,
        frame.arrays.link_relations,
        frame.arrays.link_lengths,
    )
    rows = [tuple(column.tolist()) for column in columns]
    links = [
        ((source, target, Relation(relation).name), length)
        for source, target, relation, length in zip(*rows, strict=True)
    ]
    assert len(dict(links)) == len(links)
    return dict(links)


def test_nodes_of_a_hand_made_scene():
    frame = graph_of(hand_made())
    graph = scene_graph([frame])
    assert [NodeKind(kind).name for kind in frame.arrays.kinds] == ["ROOM", "PERSON", "OBJECT", "GOAL", "WALL", "WALL"]
    expected = np.array([ROOM, PERSON, OBJECT, GOAL, NEAR_WALL, FAR_WALL])
    assert expected.shape == (6, 42)
    np.testing.assert_allclose(graph.features, expected, atol=1e-7)
    np.testing.assert_allclose(frame.arrays.lengths, [0, 0.2236068, 0.3, 0.5, 0.3047950, 0.3522783], atol=1e-7)


def test_edges_of_a_hand_made_scene():
    assert edges_of(scene_graph([graph_of(hand_made())])) == pytest.approx(FRAME_EDGES, abs=1e-6)


def test_the_length_takes_the_last_relations_place():
    graph = scene_graph([graph_of(hand_made())] * 3)
    features = {key: row for key, row in zip(edges_of(graph), graph.edge_features, strict=True)}
    wall = np.zeros(18)
    wall[6], wall[17] = 1, 1.3
    np.testing.assert_allclose(features[1, 4, "PERSON_WALL"], wall, atol=1e-6)
    np.testing.assert_array_equal(features[0, 6, "NOW_TO_SECOND"], np.eye(18)[14])
    np.testing.assert_array_equal(features[12, 6, "THIRD_TO_SECOND"], np.zeros(18))


def test_frames_are_joined_thing_by_thing_in_both_directions():
    graph = scene_graph([graph_of(hand_made())] * 3)
    expected = {
        (source + 6 * time, target + 6 * time, relation): length
        for time in range(3)
        for (source, target, relation), length in FRAME_EDGES.items()
    }
    for node in range(6):
        expected[node, node + 6, "NOW_TO_SECOND"] = 0
        expected[node + 6, node, "SECOND_TO_NOW"] = 0
        expected[node + 6, node + 12, "SECOND_TO_THIRD"] = 0
        expected[node + 12, node + 6, "THIRD_TO_SECOND"] = 0
    assert edges_of(graph) == pytest.approx(expected, abs=1e-6)
    np.testing.assert_array_equal(graph.features[:, 5:8], np.repeat(np.eye(3), 6, axis=0))
    np.testing.assert_array_equal(graph.features[6:12, 8:], graph.features[:6, 8:])


def test_who_was_not_there_a_second_ago_has_no_edge_to_then():
    now, before = (
        graph_of(hand_made(people=someone, objects=objects((0, -3)), interactions=NO_INTERACTIONS))
        for someone in (people((2, 1), (3, 1), first=1), people((3, 1), (0, 2), (1, 2), first=2))
    )
    edges = edges_of(scene_graph([now, before]))
    temporal = {(source, target) for source, target, relation in edges if relation == "NOW_TO_SECOND"}
    # now: room, persons 1 and 2, object, goal, 2 segments; then: room, persons 2, 3 and 4, object, goal, 2 segments
    assert temporal == {(0, 7), (2, 8), (3, 11), (4, 12), (5, 13), (6, 14)}
    assert {(target, source) for source, target, relation in edges if relation == "SECOND_TO_NOW"} == temporal


def test_people_are_the_same_whatever_their_order():
    first = graph_of(hand_made(people=people((2, 1), (3, 1)), interactions=NO_INTERACTIONS))
    poses = np.array([[3.0, 1, 0], [2, 1, 0]])
    swapped = People(np.array([2, 1]), poses, np.zeros_like(poses))
    second = graph_of(hand_made(people=swapped, interactions=NO_INTERACTIONS))
    pairs = {(int(a), int(b)) for a, b in zip(*matching_nodes(first.arrays.keys, second.arrays.keys), strict=True)}
    assert pairs == {(0, 0), (1, 2), (2, 1), (3, 3), (4, 4), (5, 5), (6, 6)}


@pytest.mark.parametrize(
    ("timestamps", "expected"),
    [
        ([0.0], [0]),
        ([0.0, 0.5], [1]),
        ([0.0, 1.0], [1, 0]),
        ([0.0, 0.4, 1.0, 1.3, 2.2], [4, 2, 0]),  # 2.2, then 1.0 (1.3 is too near), then 0.0
        ([0.0, 0.2, 1.15, 1.3, 2.2], [4, 2, 0]),  # 1.15 is 1.05 s older; 0.2 only 0.95 s older than that
        ([0.0, 3.0, 6.0, 9.0], [3, 2, 1]),  # never more than three
        ([5.0, 9.0], [1, 0]),  # a gap is no reason to leave out what is older
    ],
)
def test_the_window_goes_back_by_at_least_a_second_each(timestamps, expected):
    assert select_window(timestamps) == expected


@pytest.mark.parametrize("step", [0.1, 0.2, 0.05])
def test_floating_point_steps_make_whole_seconds(step):
    timestamps, time = [], 0.0
    while len(timestamps) <= 2 / step + 5:
        timestamps.append(time)
        time += step  # 0.1 ten times is 0.9999999999999999
    newest, second = len(timestamps) - 1, round(1 / step)
    assert select_window(timestamps) == [newest, newest - second, newest - 2 * second]


@pytest.mark.parametrize(
    ("length", "expected"),
    [(0.0, 1), (0.5, 1), (0.969, 1), (0.97, 2), (1.0, 2), (1.94, 3), (2.9, 3), (2.91, 4), (6.0, 7), (9.0, 10)],
)
def test_walls_are_cut_as_published(length, expected):
    assert wall_segments(np.array([[0.0, 0.0, length, 0.0], [0.0, 0.0, 0.0, -length]])).tolist() == [expected] * 2


@pytest.mark.parametrize("length", [1e5, 1e12, 1e20, 1.7e308])
def test_walls_of_more_segments_than_fit_into_memory_are_refused(length):
    walls = np.array([[-length, 1.0, length, 1.0]])
    with pytest.raises(ScenarioError, match=r"^far: a scene.s walls must have at most 100,000 seg"):
        sequence_frames(SceneSequence((hand_made(walls=walls),), "far"))


def test_a_wall_without_length_is_finite():
    frame = graph_of(hand_made(walls=np.array([[1.0, 1.0, 1.0, 1.0]])))
    assert np.isfinite(frame.arrays.features).all()
    assert len(frame) == 5


def test_interactions_go_both_ways_once():
    scene = hand_made(
        people=people((2, 1), (2, -1)),
        objects=objects((0, -3)),
        walls=np.zeros((0, 4)),
        interactions=interactions((1, 2), (101, 1), (2, 1), (1, 2), (1, 101)),
    )
    assert links_of(graph_of(scene)) == pytest.approx(
        {
            (1, 2, "PERSON_PERSON"): 0.2,
            (2, 1, "PERSON_PERSON"): 0.2,
            (3, 1, "OBJECT_PERSON"): 0.4472136,
            (1, 3, "PERSON_OBJECT"): 0.4472136,
        },
        abs=1e-6,
    )


def test_people_are_joined_to_walls_nearer_than_one_and_a_half_metres():
    wall = np.array([[0.0, 2.0, 0.5, 2.0]])  # one segment, its midpoint at (0.25, 2)
    scene = hand_made(
        people=people((0.25, 0.5), (0.25, 0.51), (0.25, 3.49)),
        objects=objects(),
        walls=wall,
        interactions=NO_INTERACTIONS,
    )
    links = links_of(graph_of(scene))
    assert {key: pytest.approx(length, abs=1e-6) for key, length in links.items()} == {
        (2, 5, "PERSON_WALL"): 1.49,
        (5, 2, "WALL_PERSON"): 1.49,
        (3, 5, "PERSON_WALL"): 1.49,
        (5, 3, "WALL_PERSON"): 1.49,
    }


def test_two_objects_cannot_interact():
    scene = hand_made(objects=objects((0, -3), (0, -2)), interactions=interactions((1, 101), (101, 102)))
    with pytest.raises(ScenarioError, match="an interaction joins two objects; at least one of the two must be a"):
        graph_of(scene)


def test_walls_must_stay():
    newest = hand_made(timestamp=1.0, walls=np.zeros((2, 4)))
    sequence = SceneSequence((hand_made(), newest), "corridor.json")
    with pytest.raises(ScenarioError, match=r"^corridor\.json: a scene's walls must not change: 2 walls .* 1 in an"):
        sequence_frames(sequence)


def test_walls_are_cut_as_in_the_newest_frame():
    older, newest = np.array([[0.0, 1.0, 0.96, 1.0]]), np.array([[0.0, 1.0, 0.98, 1.0]])
    sequence = SceneSequence((hand_made(walls=older), hand_made(timestamp=1.0, walls=newest)))
    assert [len(frame) for frame in sequence_frames(sequence)] == [6, 6]


def test_an_empty_place_is_a_room_with_a_goal():
    frame = graph_of(
        hand_made(people=people(), objects=objects(), walls=np.zeros((0, 4)), interactions=NO_INTERACTIONS)
    )
    assert [NodeKind(kind).name for kind in frame.arrays.kinds] == ["ROOM", "GOAL"]
    assert edges_of(scene_graph([frame])) == pytest.approx(
        {(1, 0, "GOAL_ROOM"): 0.5, (0, 1, "ROOM_GOAL"): 0.5, (0, 0, "SELF"): 0, (1, 1, "SELF"): 0}
    )


def test_frames_do_not_remember_the_windows_they_were_in():
    frames = sequence_frames(random_sequence(np.random.default_rng(0)))
    before = [frame.arrays.features.copy() for frame in frames]
    scene_graph(frames)
    scene_graph(frames[::-1])
    for frame, features in zip(frames, before, strict=True):
        np.testing.assert_array_equal(frame.arrays.features, features)
        assert not frame.arrays.features[:, 5:8].any()


def test_mirrored_scenes_have_mirrored_features():
    signs = np.ones(42)
    # sideways position and velocity, turning, and the side that something faces: of persons, the robot, objects,
    signs[[8, 10, 11, 14, 18, 19, 21, 22, 25]] = -1
    signs[[32, 34, 38]] = -1  # wall segments and the goal
    sequence = random_sequence(np.random.default_rng(1), num_people=4)
    graph, other = (scene_graph(sequence_frames(each)) for each in (sequence, mirrored(sequence)))
    np.testing.assert_allclose(other.features, graph.features * signs, atol=1e-7)
    assert edges_of(other) == pytest.approx(edges_of(graph), abs=1e-6)


def test_mirroring_twice_gives_the_scene_again():
    sequence = random_sequence(np.random.default_rng(2))
    graph, other = (scene_graph(sequence_frames(each)) for each in (sequence, mirrored(mirrored(sequence))))
    np.testing.assert_array_equal(graph.features, other.features)


def test_a_mirrored_frame_is_the_frame_of_the_mirrored_scene() -> None:
    for seed in range(5):
        sequence = random_sequence(np.random.default_rng(seed))
        for frame, mirror in zip(sequence_frames(sequence), sequence_frames(mirrored(sequence)), strict=True):
            np.testing.assert_allclose(mirrored_frame(frame).arrays.features, mirror.arrays.features, atol=1e-6)
            np.testing.assert_array_equal(frame.arrays.link_sources, mirror.arrays.link_sources)


def test_the_walls_of_a_mirrored_frame_can_be_turned() -> None:
    sequence = random_sequence(np.random.default_rng(3))
    mirror = mirrored(sequence)
    turned = [replace(each, walls=each.walls[:, [2, 3, 0, 1]]) for each in mirror.snapshots]
    expected = sequence_frames(replace(mirror, snapshots=tuple(turned)))
    for frame, other in zip(sequence_frames(sequence), expected, strict=True):
        features = mirrored_frame(frame, turn_walls=True).arrays.features
        assert sorted(features.round(4).tolist()) == sorted(other.arrays.features.round(4).tolist())


def test_reversed_walls_are_those_listed_from_their_other_ends():
    snapshot = hand_made()
    turned = replace(snapshot, walls=snapshot.walls[:, [2, 3, 0, 1]])
    one, other = reversed_walls(graph_of(snapshot)).arrays, graph_of(turned).arrays
    walls = one.kinds == NodeKind.WALL
    np.testing.assert_array_equal(one.features[~walls], other.features[~walls])
    np.testing.assert_array_equal(one.features[walls], other.features[walls][::-1])  # the last segment comes first
