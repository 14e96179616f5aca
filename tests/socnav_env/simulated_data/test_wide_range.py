import numpy as np
import pytest

from reward_model.analysis.heatmap import is_inside
from reward_model.networks.star import in_contact
from reward_model.scenes.scene import SceneSequence
from socnav_env.episode import STANDING
from socnav_env.simulated_data.wide_range import MAX_PEOPLE, moved_close, random_config, random_world
from socnav_env.simulated_data.windows import MOST_WINDOWS, wide_episode, windows_of_episodes
from socnav_env.simulation.snapshots import Recorder


def test_configurations_span_the_range():
    rng = np.random.default_rng(0)
    configs = [random_config(rng) for _ in range(300)]
    sides = [config.room.square_side for config in configs]
    assert (min(side[0] for side in sides), max(side[1] for side in sides)) == (3, 20)
    speeds = [config.robot.max_forward_speed for config in configs]
    assert min(speeds) < 0.35
    assert 0.9 < max(speeds) <= 1.0
    assert 0.15 < np.mean([config.people.robot_visibility == 0 for config in configs]) < 0.35


def test_worlds_have_at_most_so_many_people():
    counts = [random_world(np.random.default_rng(seed)).layout.num_people for seed in range(40)]
    assert max(counts) <= MAX_PEOPLE
    assert min(counts) <= 2


def test_a_moved_robot_is_close_to_something_inside_of_the_room():
    rng = np.random.default_rng(1)
    distances = []
    for seed in range(12):
        world = random_world(np.random.default_rng(seed))
        recorder = Recorder(world, world.config.control_period)
        for _ in range(12):
            world.advance(STANDING)
            recorder.record()
        moved = moved_close(recorder.snapshots, rng)
        SceneSequence(moved)  # is a valid scene
        assert len(moved) == 3  # the window
        assert is_inside(moved[-1].walls, np.zeros((1, 2)))[0]
        people = np.hypot(*moved[-1].people.poses[:, :2].T).min(initial=9) - 0.5
        walls = moved[-1].walls
        along = walls[:, 2:] - walls[:, :2]
        share = np.clip(-(walls[:, :2] * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
        to_walls = np.hypot(*(walls[:, :2] + share[:, None] * along).T).min() - 0.25
        objects = np.hypot(*moved[-1].objects.poses[:, :2].T).min(initial=9) - 0.25 - 0.7  # at most to the outline
        distances.append(min(people, to_walls, objects))
    assert max(distances) < 0.46


def test_few_windows_of_an_episode_are_in_contact():
    windows = windows_of_episodes(wide_episode, 3, range(12))
    assert 12 * 4 < len(windows) <= 12 * MOST_WINDOWS
    touching = in_contact(np.array([window[0].surroundings for window in windows], dtype=np.float32))
    assert touching.mean() < 0.25


@pytest.mark.parametrize("seed", [0, 7])
def test_an_episode_depends_on_its_seed_alone(seed):
    one, other = (windows_of_episodes(wide_episode, seed, [4]) for _ in range(2))
    assert len(one) == len(other)
    for first, second in zip(one, other, strict=True):
        np.testing.assert_array_equal(first[0].words, second[0].words)
