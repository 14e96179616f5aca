import numpy as np
import pytest

from reward_model.graph.features import NodeKind
from reward_model.graph.windows import frame_graph, wall_segments
from reward_model.networks.padded_windows import ABSENT, LINK_RELATIONS, pack_windows
from tests.reward_model.graph.test_windows import NO_INTERACTIONS, hand_made, objects, people


def frame(someone, **changes):
    scene = hand_made(people=someone, objects=objects(), walls=np.array([[2.0, 2.0, 2.0, 2.5]]), **changes)
    return frame_graph(scene, wall_segments(scene.walls))


def alone(*places, first=1):
    return frame(people(*places, first=first), interactions=NO_INTERACTIONS)


def kinds_of(batch, time, index):
    return ["-" if kind == ABSENT else NodeKind(int(kind)).name[0] for kind in batch.kinds[time, index]]


def test_windows_are_padded_to_one_grid():
    batch = pack_windows([[alone((2, 1), (3, 1))], [alone((2, 1)), alone((2, 1))]])
    assert batch.features.shape == (2, 2, 5, 42)  # the longest has two frames
    assert kinds_of(batch, 0, 0) == ["R", "P", "P", "G", "W"]
    assert kinds_of(batch, 1, 0) == ["-", "-", "-", "-", "-"]
    assert kinds_of(batch, 0, 1) == ["R", "P", "G", "W", "-"]
    assert kinds_of(batch, 1, 1) == ["R", "P", "G", "W", "-"]
    assert batch.together[:, 1].tolist() == [[1, 1, 1, 1, 0]]
    assert batch.features[0, 0, :, 5:8].tolist() == [[1, 0, 0]] * 5
    assert batch.features[1, 1, :4, 5:8].tolist() == [[0, 1, 0]] * 4
    assert not batch.features[1, 0].any()


def test_a_thing_keeps_its_slot():
    newest, older, oldest = alone((2, 1), (3, 1)), alone((3, 1), (0, 2), first=2), alone((2, 1), first=1)
    batch = pack_windows([[newest, older, oldest]])
    # slots: room, persons 1 and 2, goal, wall, and person 3 behind them
    assert kinds_of(batch, 0, 0) == ["R", "P", "P", "G", "W", "-"]
    assert kinds_of(batch, 1, 0) == ["R", "-", "P", "G", "W", "P"]
    assert kinds_of(batch, 2, 0) == ["R", "P", "-", "G", "W", "-"]
    assert batch.together[:, 0].tolist() == [[1, 0, 1, 1, 1, 0], [1, 0, 0, 1, 1, 0]]


def test_degrees_count_incoming_edges():
    near_wall = alone((2, 1.5))  # 0.75 m from the segment's midpoint
    batch = pack_windows([[near_wall, near_wall]])
    # room: 3 others, itself, the other frame; person and wall: the room, itself, each other, the other frame
    assert batch.degrees[:, 0].tolist() == [[5, 4, 3, 4], [5, 4, 3, 4]]


def test_links_point_into_the_flattened_grid_sorted_by_relation():
    near_wall = alone((2, 1.5))
    batch = pack_windows([[near_wall], [near_wall, near_wall]])
    assert [relation.name for relation in LINK_RELATIONS][-2:] == ["PERSON_WALL", "WALL_PERSON"]
    assert batch.link_counts == (0, 0, 0, 3, 3)
    # 4 slots a window and 2 windows a frame: persons in slot 1, segments in slot 3
    assert sorted(batch.link_sources[:3].tolist()) == [1, 5, 13]
    assert sorted(batch.link_targets[:3].tolist()) == [3, 7, 15]
    assert batch.link_sources[3:].tolist() == batch.link_targets[:3].tolist()
    assert batch.link_lengths.tolist() == pytest.approx([0.75] * 6)


def test_batches_move_between_devices():
    batch = pack_windows([[alone((2, 1.5))]]).to("meta")
    assert batch.features.device.type == batch.link_sources.device.type == "meta"
    assert batch.link_counts == (0, 0, 0, 1, 1)
