import numpy as np
import pytest

from reward_model.graph.frame import UNKNOWN_SURROUNDINGS, FrameGraph, Surroundings, stack_windows
from reward_model.graph.windows import frame_graph, mirrored_frame, wall_segments
from tests.reward_model.graph.test_windows import NO_INTERACTIONS, hand_made, objects, people
from tests.reward_model.random_scenes import random_windows

SQUARE = np.array([[-2.0, -3.0, 4.0, -3.0], [4.0, -3.0, 4.0, 3.0], [4.0, 3.0, -2.0, 3.0], [-2.0, 3.0, -2.0, -3.0]])


def surroundings_of(**parts) -> Surroundings:
    snapshot = hand_made(**{"interactions": NO_INTERACTIONS, **parts})
    return frame_graph(snapshot, wall_segments(snapshot.walls)).surroundings


def test_distances_to_the_closest_person_object_and_wall():
    found = surroundings_of(people=people((3.0, 4.0), (0.0, 2.0)), objects=objects((0.0, -1.0)), walls=SQUARE)
    assert found == pytest.approx((2.0, 1.0 - objects((0.0, -1.0)).sizes[0, 1] / 2, 2.0, 6.0), abs=1e-6)


def test_nothing_is_infinitely_far():
    assert surroundings_of(people=people(), objects=objects(), walls=np.zeros((0, 4))) == UNKNOWN_SURROUNDINGS


def test_an_object_is_a_turned_box():
    box = objects((2.0, 0.0))
    box.sizes[0] = (2.0, 0.5)
    box.poses[0, 2] = np.pi / 4  # its corner (1, 0.25) is at (2 - 0.75 / sqrt 2, 1.25 / sqrt 2) when turned back
    expected = np.hypot(np.sqrt(2) - 1.0, np.sqrt(2) - 0.25)  # in the box's axes the robot is at (-sqrt 2, sqrt 2)
    assert surroundings_of(objects=box, walls=SQUARE).object == pytest.approx(expected, abs=1e-6)
    box.poses[0, :2] = (0.1, 0.0)
    assert surroundings_of(objects=box, walls=SQUARE).object == 0.0


def test_the_extent_does_not_depend_on_where_the_robot_looks():
    for angle in (0.0, 0.3, 1.1):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        long = np.array([[0.0, 0.0, 12.0, 0.0], [12.0, 0.0, 12.0, 3.0], [12.0, 3.0, 0.0, 3.0], [0.0, 3.0, 0.0, 0.0]])
        turned = (long.reshape(-1, 2, 2) @ turn.T).reshape(-1, 4)
        assert surroundings_of(walls=turned).extent == pytest.approx(12.0, abs=1e-5)


def test_images_and_other_forms_keep_them():
    (frame, *_), *_ = random_windows(3, count=2)
    assert frame.surroundings.person > 0
    assert mirrored_frame(frame).surroundings == frame.surroundings
    assert FrameGraph(*frame.arrays).surroundings == frame.surroundings
    assert FrameGraph(*frame.arrays[:-1]).surroundings == UNKNOWN_SURROUNDINGS


def test_numbers_beyond_any_room_do_not_break_them():
    snapshot = hand_made(people=people((1e300, 0.0)), walls=SQUARE * 1e300, interactions=NO_INTERACTIONS)
    assert not np.isnan(frame_graph(snapshot, np.ones(4, dtype=np.int64)).surroundings).any()


def test_a_stack_has_all_frames_newest_first():
    windows = random_windows(4, count=3)
    stack = stack_windows(windows)
    assert stack.sizes.tolist() == [len(window) for window in windows]
    np.testing.assert_array_equal(stack.words, np.concatenate([frame.words for each in windows for frame in each]))
