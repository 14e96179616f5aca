import math

import gymnasium as gym
import numpy as np
import pytest

from socnav_env.config import TALKING, EnvConfig
from socnav_env.env import SocNavEnv
from socnav_env.people.conversations import free_place
from socnav_env.people.interactions import (
    InteractionPairs,
    changed,
    circles_of,
    history_of,
    interactions_at,
    linked_groups,
    standing_groups,
)
from socnav_env.recording.files import RecordTrajectory, read_recording
from socnav_env.recording.replay import first_difference, replay
from socnav_env.rewards.learned import LearnedReward
from socnav_env.scenes.population import sample_layout
from socnav_env.simulation.snapshots import Recorder
from socnav_env.simulation.world import World
from tests.socnav_env.puppets import make_layout

NOBODY = {"still": [0, 0], "wandering": [0, 0], "tables": [0, 0], "plants": [0, 0], "interactions": [0, 0]}
HALL = {"kinds": ["square"], "square_side": [10, 10]}


def config_with(conversations, people=None, **population):
    values = {"room": HALL, "population": NOBODY | population | {"conversations": conversations}}
    return EnvConfig.from_dict(values | {"people": {"stop_distance": 0.0, "robot_visibility": 0.0} | (people or {})})


def world_of(config, seed=0):
    rng = np.random.default_rng(seed)
    return World(sample_layout(config, rng), config, rng)


def run(world, seconds):
    for _ in range(round(seconds / 0.2)):
        world.advance(np.zeros(3))
    return world


def test_the_free_place_is_in_the_widest_gap():
    two = np.array([[1.0, 0.0], [-1.0, 0.0]])
    assert np.abs(free_place(two, 0.9)) == pytest.approx([0.0, 1.0])
    three = np.array([[math.cos(angle), math.sin(angle)] for angle in (0.0, math.pi / 2, math.pi)])
    x, y = free_place(three, 0.9)
    assert x == pytest.approx(0.0)
    assert -1.0 < y < -0.5


def test_the_free_place_is_farther_out_where_the_circle_is_full():
    angles = np.arange(4) * math.pi / 2
    four = 0.6 * np.column_stack([np.cos(angles), np.sin(angles)])
    place = free_place(four, 0.9)
    assert np.sort(np.hypot(*(four - place).T))[:2] == pytest.approx([0.9, 0.9])


def test_pairs_begin_and_end():
    layout = make_layout(people_poses=np.zeros((3, 3)), interaction_pairs=np.array([[1, 0]]))
    changes = np.array([[2, 0, 2, 1], [3, 0, 1, 0], [5, 0, 1, 1]])
    assert interactions_at(2, layout, changes).pairs.tolist() == [[1, 0], [0, 2]]
    assert interactions_at(3, layout, changes).pairs.tolist() == [[0, 2]]
    history = history_of(layout, changes, 7)
    assert history.pairs.tolist() == [[1, 0], [0, 2]]
    assert history.relations == (TALKING, TALKING)
    assert history.present.T.astype(int).tolist() == [[1, 1, 1, 0, 0, 1, 1], [0, 0, 1, 1, 1, 1, 1]]


def test_only_talking_ends():
    interactions = InteractionPairs(np.array([[0, 1], [0, 1]]), ("wandering_human_interacting", TALKING))
    ended = changed(interactions, [0, 1], begins=False)
    assert ended.relations == ("wandering_human_interacting",)


def test_circles_are_of_three_or_more():
    pairs = np.array([[0, 1], [1, 2], [0, 2], [3, 4]])
    places = np.array([[1.0, 0.0], [-0.5, 0.8660254], [-0.5, -0.8660254], [5.0, 0.0], [6.0, 0.0]])
    circles = circles_of(InteractionPairs(pairs, (TALKING,) * 4), places)
    assert circles == pytest.approx(np.array([[0.0, 0.0, 1.0]]))


def test_people_join_a_circle_up_to_its_size_and_face_its_middle():
    config = config_with({"join_rate": 1.0, "max_size": 4}, circles=[1, 1], circle_size=[3, 3], wandering=[2, 2])
    world = run(world_of(config), 60.0)
    assert world.layout.interaction_pairs.tolist() == [[0, 1], [0, 2], [1, 2]]
    (group,) = linked_groups(world.interactions)
    assert len(group) == 4
    assert len(world.interactions.pairs) == 6
    assert len(world.interaction_changes) == 3
    poses = world.people_poses[group]
    middle = poses[:, :2].mean(axis=0)
    ways = np.arctan2(middle[1] - poses[:, 1], middle[0] - poses[:, 0])
    assert max(abs(math.remainder(way - pose[2], 2 * math.pi)) for way, pose in zip(ways, poses, strict=True)) < 0.5
    apart = np.hypot(*(poses[:, None, :2] - poses[:, :2]).transpose(2, 0, 1))
    assert apart[~np.eye(4, dtype=bool)].min() > 0.6


def test_people_leave_and_the_last_one_goes_too():
    config = config_with({"leave_rate": 0.5}, circles=[1, 1], circle_size=[3, 3])
    world = run(world_of(config), 20.0)
    assert world.interactions.pairs.shape == (0, 2)
    assert world.interactions.relations == ()
    assert sorted(world.interaction_changes[:, 1:].tolist()) == [[0, 1, 0], [0, 2, 0], [1, 2, 0]]
    assert np.hypot(*(world.people_poses - world.layout.people_poses)[:, :2].T).min() > 0.5


def test_nothing_changes_where_that_is_off():
    config = config_with({}, circles=[1, 1], circle_size=[3, 3], wandering=[2, 2])
    world = world_of(config)
    before = world.interactions
    run(world, 10.0)
    assert world.interactions is before
    assert world.interaction_changes.shape == (0, 4)
    assert world.people_poses[:3].tolist() == world.layout.people_poses[:3].tolist()


def test_snapshots_say_who_talks_at_their_time():
    config = config_with({"leave_rate": 0.5}, circles=[1, 1], circle_size=[3, 3])
    world = world_of(config)
    recorder, counts = Recorder(world, config.control_period), []
    for _ in range(60):
        world.advance(np.zeros(3))
        recorder.record()
        counts.append(len(recorder.snapshots[-1].interactions.relations))
        assert counts[-1] == len(world.interactions.relations)
    assert counts[0] == 3
    assert set(counts) == {3, 1, 0}
    widths = [len(snapshot.interactions.pairs) for snapshot in recorder.snapshots]
    assert widths == counts[-len(widths) :]


def test_an_episode_with_changes_is_recorded_and_replays(tmp_path, feature_reward: LearnedReward):
    config = EnvConfig.from_dict(
        {"time_limit": 8.0, "robot": {"min_goal_distance": 4.0}, "room": HALL,
         "population": NOBODY | {"circles": [1, 1], "wandering": [3, 3],
                                 "conversations": {"join_rate": 0.5, "leave_rate": 0.1}}}
    )  # fmt: skip
    env = RecordTrajectory(SocNavEnv(reward=feature_reward, config=config), tmp_path)
    _, info = env.reset(seed=2)
    done = False
    while not done:
        _, _, terminated, truncated, info = env.step(np.zeros(2, dtype=np.float32))
        done = terminated or truncated
    env.close()
    recording = read_recording(next(tmp_path.glob("*.npz")))
    trajectory = recording.trajectory
    assert len(trajectory.interaction_changes) > 0
    repeated = replay(recording)
    assert first_difference(trajectory, repeated) is None
    assert repeated.interaction_changes.tolist() == trajectory.interaction_changes.tolist()
    assert np.isfinite(info["episode_metrics"]["group_intrusion"])
    assert trajectory.interactions.present.shape == (len(trajectory) + 1, len(trajectory.interactions.pairs))


def test_observations_have_room_for_all_who_may_talk():
    conversations = {"join_rate": 0.5, "leave_rate": 0.2, "max_size": 4}
    population = {"interactions": [2, 2], "relations": [TALKING], "wandering": [4, 4]}
    config = config_with(conversations, **population)
    assert config.population.max_interactions == 2 * math.comb(4, 2)
    env = gym.make("SocNav2-v0", reward="sparse", config=config)
    for seed in range(3):
        observation, _ = env.reset(seed=seed)
        for _ in range(30):
            observation, _, terminated, _, _ = env.step(np.zeros(2, dtype=np.float32))
            assert env.observation_space.contains(observation)
            if terminated:
                break


def test_who_talks_is_found_in_a_layout():
    pairs = np.array([[0, 1], [2, 3], [3, 1]])
    layout = make_layout(
        people_poses=np.zeros((4, 3)), interaction_pairs=pairs, interaction_relations=(TALKING, TALKING, TALKING)
    )
    assert standing_groups(layout) == [[0, 1, 2, 3]]
