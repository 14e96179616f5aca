import numpy as np
import pytest

from reward_model.graph.windows import sequence_frames
from reward_model.scenes.scene import SceneSequence
from reward_model.scenes.time_scale import slowed
from socnav_env.config import EnvConfig
from socnav_env.scenes.population import sample_layout
from socnav_env.simulation.snapshots import Recorder, frames_per_window
from socnav_env.simulation.world import World
from tests.socnav_env.puppets import PuppetWorld, make_layout

PERIOD = 0.2  # s


def recorded(world: PuppetWorld, *commands: tuple[float, float]) -> Recorder:
    recorder = Recorder(world, PERIOD)
    for command in commands:
        world.advance(np.array([command[0], 0.0, command[1]]))
        recorder.record()
    return recorder


def test_a_snapshot_stands_in_the_frame_of_the_robot() -> None:
    world = PuppetWorld(make_layout(robot_pose=np.array([1.0, 0.0, np.pi / 2])))
    world.time, world.command = 4.0, np.array([0.3, 0.0, -0.1])
    snapshot = Recorder(world, PERIOD).snapshots[-1]
    assert snapshot.timestamp == 4.0
    assert snapshot.interval == 0.2
    np.testing.assert_array_equal(snapshot.command, [0.3, 0.0, -0.1])
    np.testing.assert_allclose(snapshot.goal, [0.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(snapshot.people.poses, [[2.0, 0.0, -np.pi], [-1.0, 0.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(snapshot.objects.poses, np.tile([0.0, 3.0, -np.pi / 2], (2, 1)), atol=1e-12)
    np.testing.assert_array_equal(snapshot.objects.sizes, [[0.8, 0.6], [0.8, 0.6]])
    clockwise = [[3, 4, 3, -2], [3, -2, -3, -2], [-3, -2, -3, 4], [-3, 4, 3, 4]]  # as genuine recordings have them
    np.testing.assert_allclose(snapshot.walls, clockwise, atol=1e-12)
    np.testing.assert_array_equal(snapshot.robot_pose, [1.0, 0.0, np.pi / 2])


def test_people_are_numbered_from_one_and_objects_after_them() -> None:
    layout = make_layout(
        interaction_pairs=np.array([[0, 1], [1, 3]]),
        interaction_relations=("two_static_person_talking", "human_laptop_interaction"),
    )
    snapshot = Recorder(PuppetWorld(layout), PERIOD).snapshots[-1]
    np.testing.assert_array_equal(snapshot.people.ids, [1, 2])
    np.testing.assert_array_equal(snapshot.objects.ids, [3, 4])
    np.testing.assert_array_equal(snapshot.interactions.pairs, [[1, 2], [2, 4]])
    assert snapshot.interactions.relations == ("two_static_person_talking", "human_laptop_interaction")


def test_the_first_snapshot_has_no_velocities() -> None:
    snapshot = recorded(PuppetWorld()).snapshots[0]
    assert not snapshot.people.velocities.any()
    assert not snapshot.objects.velocities.any()


def test_what_stands_still_comes_towards_a_robot_that_drives() -> None:
    snapshot = recorded(PuppetWorld(), (0.5, 0.0)).snapshots[-1]
    np.testing.assert_allclose(snapshot.people.velocities, np.tile([-0.5, 0.0, 0.0], (2, 1)), atol=1e-12)
    np.testing.assert_allclose(snapshot.objects.velocities, np.tile([-0.5, 0.0, 0.0], (2, 1)), atol=1e-12)


def test_what_stands_still_circles_around_a_robot_that_turns() -> None:
    snapshot = recorded(PuppetWorld(), (0.0, 0.4)).snapshots[-1]
    table = snapshot.objects.velocities[0]  # 2 m behind: it moves left while the robot turns to its left
    angle = 0.4 * PERIOD
    np.testing.assert_allclose(table, [2 * (1 - np.cos(angle)) / PERIOD, 2 * np.sin(angle) / PERIOD, -0.4], atol=1e-12)


def test_a_person_who_walks_beside_the_robot_stands_still_in_its_frame() -> None:
    world = PuppetWorld()
    world.people_velocities = np.array([[0.5, 0.0, 0.0], [0.0, 0.3, 1.0]])
    velocities = recorded(world, (0.5, 0.0)).snapshots[-1].people.velocities
    np.testing.assert_allclose(velocities, [[0.0, 0.0, 0.0], [-0.5, 0.3, 1.0]], atol=1e-12)


def test_headings_that_cross_half_a_turn_do_not_spin() -> None:
    world = PuppetWorld(make_layout(people_poses=np.array([[1.0, 2.0, 3.1], [1.0, -1.0, 0.0]])))
    world.people_velocities[0, 2] = 1.0
    rates = recorded(world, (0.0, 0.0)).snapshots[-1].people.velocities[:, 2]
    np.testing.assert_allclose(rates, [1.0, 0.0], atol=1e-12)


def test_snapshots_keep_their_numbers_when_later_ones_are_taken() -> None:
    world = PuppetWorld()
    recorder = recorded(world, (0.5, 0.1))
    snapshot = recorder.snapshots[-1]
    poses, velocities = snapshot.people.poses.copy(), snapshot.people.velocities.copy()
    world.advance(np.array([0.5, 0.0, 0.1]))
    recorder.record()
    np.testing.assert_array_equal(snapshot.people.poses, poses)
    np.testing.assert_array_equal(snapshot.people.velocities, velocities)


def test_a_window_has_frames_a_second_apart_newest_first() -> None:
    world = PuppetWorld()
    recorder = Recorder(world, PERIOD)
    frames = [recorder.window()[0]]
    for _ in range(14):
        world.advance(np.array([0.1, 0.0, 0.0]))
        recorder.record()
        frames.append(recorder.window()[0])
    window = recorder.window()
    assert [frames.index(frame) for frame in window] == [14, 9, 4]  # the very frames, computed once


@pytest.mark.parametrize(("records", "length"), [(1, 1), (5, 1), (6, 2), (10, 2), (11, 3), (40, 3)])
def test_a_short_past_makes_a_short_window(records: int, length: int) -> None:
    assert len(recorded(PuppetWorld(), *[(0.1, 0.1)] * (records - 1)).window()) == length


@pytest.mark.parametrize(("period", "frames"), [(0.05, 41), (0.1, 21), (0.2, 11), (0.3, 9), (1.0, 3), (1.5, 3)])
def test_as_many_snapshots_are_kept_as_a_window_reaches_across(period: float, frames: int) -> None:
    assert frames_per_window(period) == frames
    world = PuppetWorld(control_period=period)
    recorder = Recorder(world, period)
    for _ in range(2 * frames):
        world.advance(np.array([0.1, 0.0, 0.0]))
        recorder.record()
        wanted = sequence_frames(SceneSequence(recorder.snapshots))
        assert len(recorder.window()) == len(wanted)
        for kept, computed in zip(recorder.window(), wanted, strict=True):
            np.testing.assert_array_equal(kept.arrays.features, computed.arrays.features)
    assert len(recorder.snapshots) == frames
    assert len(recorder.window()) == 3


def test_a_window_is_what_the_same_snapshots_give_as_a_recorded_sequence() -> None:
    config = EnvConfig()
    random = np.random.default_rng(5)
    world = World(sample_layout(config, random), config, random)
    recorder = Recorder(world, config.control_period)
    for _ in range(23):
        world.advance(np.array([0.2, 0.0, 0.3]))
        recorder.record()
    pairs = list(zip(recorder.window(), sequence_frames(SceneSequence(recorder.snapshots)), strict=True))
    assert len(pairs) == 3
    for kept, computed in pairs:
        np.testing.assert_array_equal(kept.arrays.features, computed.arrays.features)
        np.testing.assert_array_equal(kept.arrays.link_lengths, computed.arrays.link_lengths)


@pytest.mark.parametrize(("time_scale", "spacing"), [(2.0, 3), (2.5, 2), (2.7, 2), (4.0, 2), (5.0, 1), (1e9, 1)])
def test_a_slowed_window_is_what_the_slowed_snapshots_give(time_scale: float, spacing: int) -> None:
    config = EnvConfig()
    random = np.random.default_rng(5)
    world = World(sample_layout(config, random), config, random)
    recorder = Recorder(world, config.control_period, time_scale)
    for _ in range(9):
        world.advance(np.array([0.2, 0.0, 0.3]))
        recorder.record()
    assert len(recorder.snapshots) == 2 * spacing + 1
    wanted = sequence_frames(slowed(SceneSequence(recorder.snapshots), time_scale))
    assert len(recorder.window()) == len(wanted) == 3
    for kept, computed in zip(recorder.window(), wanted, strict=True):
        for mine, theirs in zip(kept.arrays, computed.arrays, strict=True):
            np.testing.assert_array_equal(mine, theirs)


def test_an_empty_room_is_a_scene_too() -> None:
    layout = make_layout(
        people_poses=np.zeros((0, 3)),
        people_walk=np.zeros(0, dtype=np.bool_),
        people_group=np.zeros(0, dtype=np.int64),
        object_poses=np.zeros((0, 3)),
        object_sizes=np.zeros((0, 2)),
        object_kinds=np.zeros(0, dtype=np.int64),
        interaction_pairs=np.zeros((0, 2), dtype=np.int64),
        interaction_relations=(),
    )
    recorder = recorded(PuppetWorld(layout), (0.1, 0.0))
    SceneSequence(recorder.snapshots)  # checks every field
    assert len(recorder.window()) == 1
