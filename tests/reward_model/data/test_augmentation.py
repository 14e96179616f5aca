import math
from dataclasses import replace

import numpy as np

from reward_model.data.augmentation import judged_moments, mirrored, moments, rotated
from reward_model.scenes.scene import SceneSequence
from reward_model.scenes.socnav2_json import parse_socnav2, read_socnav2, socnav2_document
from tests.reward_model.example_scenes import hand_made_document


def hand_made() -> SceneSequence:
    return parse_socnav2(hand_made_document(), "hand.json")


def assert_same_scene(first: SceneSequence, second: SceneSequence):
    """Headings count as directions: whole turns make no difference."""
    assert len(first) == len(second)
    for one, other in zip(first, second, strict=True):
        assert (one.timestamp, one.interval) == (other.timestamp, other.interval)
        np.testing.assert_allclose(one.command, other.command, atol=1e-12)
        np.testing.assert_allclose(one.goal, other.goal, atol=1e-12)
        np.testing.assert_allclose(one.walls, other.walls, atol=1e-12)
        for poses, others in (
            (one.people.poses, other.people.poses),
            (one.objects.poses, other.objects.poses),
            (one.robot_pose[None], other.robot_pose[None]),
        ):
            np.testing.assert_allclose(poses[:, :2], others[:, :2], atol=1e-12)
            np.testing.assert_allclose(np.exp(1j * poses[:, 2]), np.exp(1j * others[:, 2]), atol=1e-12)
        np.testing.assert_allclose(one.people.velocities, other.people.velocities, atol=1e-12)
        np.testing.assert_allclose(one.objects.velocities, other.objects.velocities, atol=1e-12)
        np.testing.assert_array_equal(one.objects.sizes, other.objects.sizes)


def test_mirroring_swaps_left_and_right():
    last = mirrored(hand_made()).last
    np.testing.assert_allclose(last.command, [0.2, 0.1, 0.2])
    np.testing.assert_allclose(last.goal, [3.0, 1.0])
    np.testing.assert_allclose(last.people.poses[0], [1.8, 1.1, math.pi / 2 - 0.25])
    np.testing.assert_allclose(last.people.velocities[0], [-0.4, 0.2, -0.5])
    np.testing.assert_allclose(last.objects.poses, [[-1.0, 0.0, 0.25 + math.pi / 2]])
    np.testing.assert_allclose(last.walls[0], [5.0, 4.0, -5.0, 4.0])
    np.testing.assert_allclose(last.robot_pose, [1.5, 0.5, 0.125])
    np.testing.assert_allclose(last.objects.sizes, [[0.5, 0.75]])


def test_mirroring_changes_the_sign_of_x_in_the_json():
    before = socnav2_document(hand_made())[-1]["people"][0]
    after = socnav2_document(mirrored(hand_made()))[-1]["people"][0]
    np.testing.assert_allclose(
        [after[key] for key in ("x", "y", "vx", "vy", "va")], [-1.1, 1.8, 0.1, 0.2, 0.25], atol=1e-12
    )
    np.testing.assert_allclose(math.cos(after["a"]), -math.cos(before["a"]))
    np.testing.assert_allclose(math.sin(after["a"]), math.sin(before["a"]))


def test_rotating_lets_the_robot_reverse():
    last = rotated(hand_made()).last
    np.testing.assert_allclose(last.command, [-0.2, 0.1, -0.2])
    np.testing.assert_allclose(last.goal, [-3.0, 1.0])
    np.testing.assert_allclose(last.people.poses[0], [-1.8, 1.1, math.pi / 2 + 0.25])
    np.testing.assert_allclose(last.people.velocities[0], [0.4, 0.2, 0.5])
    np.testing.assert_allclose(last.walls[0], [-5.0, 4.0, 5.0, 4.0])
    np.testing.assert_allclose(last.robot_pose, [1.5, -0.5, math.pi - 0.125])


def test_doing_either_twice_gives_the_scene_again(shared_data):
    for path in sorted((shared_data / "socnav2_samples").glob("S*.json")):
        sequence = read_socnav2(path)
        assert_same_scene(mirrored(mirrored(sequence)), sequence)
        assert_same_scene(rotated(rotated(sequence)), sequence)


def test_the_order_of_mirroring_and_rotating_does_not_matter():
    assert_same_scene(mirrored(rotated(hand_made())), rotated(mirrored(hand_made())))


def test_the_original_is_left_alone():
    sequence = hand_made()
    mirrored(sequence)
    rotated(sequence)
    assert_same_scene(sequence, hand_made())


def test_moments_of_a_recording_of_four_seconds():
    times = [4 * index / 34 for index in range(35)]
    windows = moments(times)
    # The last, a second earlier, and the same from half a second earlier on: each a second apart, or a little more.
    assert windows == [[34, 25, 16], [25, 16, 7], [29, 20, 11], [20, 11, 2]]


def test_short_recordings_have_fewer_moments():
    assert moments([0.0]) == [[0]]
    assert moments([0.0, 0.6]) == [[1], [0]]
    assert moments([0.0, 1.0]) == [[1, 0], [0], [0]]


def test_snapshots_that_no_moment_needs_can_be_left_out():
    scene = hand_made()
    times = np.linspace(0.0, 4.0, 35).tolist()
    long = replace(scene, snapshots=tuple(replace(scene.last, timestamp=time) for time in times))
    short = judged_moments(long)
    assert len(short) == 8
    left = [snapshot.timestamp for snapshot in short]
    assert [[left[place] for place in window] for window in moments(left)] == [
        [times[place] for place in window] for window in moments(times)
    ]
