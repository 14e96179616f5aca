import numpy as np
import pytest

from reward_model.data.augmentation import mirrored
from reward_model.graph.star import KINDS, WIDTHS, Stars
from reward_model.graph.windows import frame_graph, mirrored_frame, reversed_walls, sequence_frames, wall_segments
from tests.reward_model.graph.test_windows import NO_INTERACTIONS, hand_made, interactions, objects, people
from tests.reward_model.random_scenes import random_sequence, random_windows

WALL = np.array([[2.0, -0.4, 2.0, 0.4]])  # one segment, 2 m ahead, across


def star_of(*snapshots) -> Stars:
    segments = wall_segments(snapshots[0].walls)
    return Stars.of_windows([[frame_graph(each, segments) for each in snapshots]])


def test_a_person_beside_a_wall_in_every_column():
    snapshot = hand_made(
        people=people((1.0, 0.5)), objects=objects(), walls=WALL, interactions=NO_INTERACTIONS, goal=(3.0, 4.0)
    )
    star = star_of(snapshot)
    x, y, distance = -0.05, 0.1, np.hypot(1.0, 0.5) / 10  # dam, x to the right and y forward
    frame_even, frame_odd = [y, 0.0, -1.0, distance], [x, 0.0, 0.0, 0.0]  # a is -pi / 2
    to_wall = np.hypot(1.0, 0.5) / 10  # of the segment's midpoint, (2, 0)
    near = [np.exp(-distance / 0.05), np.exp(-distance / 0.15)]
    np.testing.assert_allclose(star.people[0, :12], frame_even * 3, atol=1e-6)
    np.testing.assert_allclose(star.people[0, 12:17], [to_wall, 0.1, 0.0, *near], atol=1e-6)
    np.testing.assert_allclose(star.people[0, 17:], frame_odd * 3, atol=1e-6)
    np.testing.assert_allclose(star.walls[0, :9], [0.2, -1.0, 0.2] * 3, atol=1e-6)  # y, cos 2o, distance
    np.testing.assert_allclose(star.rooms[0, :2], [0.3, 0.5], atol=1e-6)
    np.testing.assert_allclose(star.rooms[0, 9:15], [1 / 15, 1 / 225, 1 / 50, 0.0, 0.0, 10 / 4], atol=1e-6)
    assert star.counts.tolist() == [[1, 0, 1, 0]]


def test_pairs_know_where_the_robot_is_from_the_line_between_them():
    snapshot = hand_made(
        people=people((1.0, 1.0), (1.0, -3.0)), objects=objects(), walls=WALL, interactions=interactions((1, 2))
    )
    star = star_of(snapshot)
    assert star.counts[0, KINDS.index("pairs")] == 2  # each way
    distance, along = 0.1, 0.25 * 0.75
    np.testing.assert_allclose(star.pairs[:, 2], [distance, distance], atol=1e-6)
    np.testing.assert_allclose(star.pairs[:, 3], [along, along], atol=1e-6)
    np.testing.assert_allclose(star.pairs[:, 24], [0.4, 0.4], atol=1e-6)  # the line's length
    assert star.people[:, 14].tolist() == [1.0, 1.0]  # both interact


def test_the_mirror_image_changes_the_sign_of_odd_columns_alone():
    rng = np.random.default_rng(2)
    for seed in range(4):
        sequence = random_sequence(rng, 1 + seed % 3, 4, 3, come_and_go=seed > 1)
        star, image = (Stars.of_windows([sequence_frames(each)]) for each in (sequence, mirrored(sequence)))
        for name, (even, _) in WIDTHS.items():
            one, other = getattr(star, name), getattr(image, name)
            np.testing.assert_allclose(one[:, :even], other[:, :even], atol=1e-6, err_msg=name)
            np.testing.assert_allclose(one[:, even:], -other[:, even:], atol=1e-6, err_msg=name)


def test_the_direction_of_walls_says_nothing():
    windows = random_windows(5, count=4)
    star = Stars.of_windows(windows)
    other = Stars.of_windows([[reversed_walls(frame) for frame in window] for window in windows])
    for name, rows in star.arrays().items():
        np.testing.assert_array_equal(rows, getattr(other, name), err_msg=name)
    turned = Stars.of_windows([[mirrored_frame(frame, turn_walls=True) for frame in each] for each in windows])
    np.testing.assert_array_equal(turned.walls[:, :11], star.walls[:, :11])


def test_missing_frames_and_entities_stand_still():
    rng = np.random.default_rng(3)
    frames = sequence_frames(random_sequence(rng, 3, 3, 2))
    one, two = Stars.of_windows([frames[:1]]), Stars.of_windows([frames[:2]])
    np.testing.assert_array_equal(one.people[:, :4], one.people[:, 8:12])
    np.testing.assert_array_equal(two.people[:, 4:8], two.people[:, 8:12])
    assert (two.people[:, :4] != two.people[:, 4:8]).any()


def test_numbers_beyond_any_room_are_bounded():
    snapshot = hand_made(
        people=people((1e300, 0.0), (0.0, -1e38)),
        objects=objects((1e200, 1e200)),
        walls=WALL * 1e150,
        interactions=interactions((1, 2)),
        goal=(1e308, -1e308),
    )
    star = Stars.of_windows([[frame_graph(snapshot, np.array([3]))]])
    for name, rows in star.arrays().items():
        if name != "surroundings":
            assert np.isfinite(rows).all(), name


def test_windows_can_be_taken_and_joined():
    windows = random_windows(6, count=5)
    stars = Stars.of_windows(windows)
    chosen = stars.taken(np.array([3, 0, 3]))
    again = Stars.of_windows([windows[3], windows[0], windows[3]])
    halves = Stars.joined([stars.taken(np.arange(2)), stars.taken(np.arange(2, 5))])
    stored = Stars.of_arrays(stars.arrays())
    for name, rows in again.arrays().items():
        np.testing.assert_array_equal(getattr(chosen, name), rows)
        np.testing.assert_array_equal(getattr(halves, name), getattr(stars, name))
        assert getattr(stored, name) is getattr(stars, name)
    assert len(stars[1:3]) == 2
    assert len(Stars.of_windows([])) == len(Stars.joined([])) == 0
    assert Stars.of_windows(stars) is stars


@pytest.mark.parametrize("name", WIDTHS)
def test_rows_have_their_widths(name):
    assert getattr(Stars.of_windows(random_windows(7, count=2)), name).shape[1] == sum(WIDTHS[name])
