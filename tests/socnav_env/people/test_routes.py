"""Episodes that a script sets up: what it tells of the warm-up, and where it sends people."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from socnav_env.config import EnvConfig, PeopleConfig
from socnav_env.episode import Episode
from socnav_env.layout import Ending, Layout, Script
from socnav_env.recording.arrays import SCRIPT_ARRAYS, RecordingError
from socnav_env.recording.files import Recording, read_recording, write_recording
from socnav_env.recording.replay import first_difference, replay, rerun_without_robot
from socnav_env.simulation.world import World
from socnav_env.trajectories.versions import simulation_versions
from tests.socnav_env.puppets import make_layout

CONFIG = EnvConfig(time_limit=20.0, people=PeopleConfig(robot_visibility=0.0))
ROWS = CONFIG.warm_up_steps + 1
AGES = 0.2 * np.arange(ROWS - 1, -1, -1)  # s before the start


def scripted(route=((-1.0, -1.0),), ending: Ending = Ending.STAND, delay: float = 0.0) -> Layout:
    """Two people: one who stands and, on y = -1, one who comes from the right at 0.5 m/s and follows a route."""
    layout = make_layout(robot_pose=np.array([0.0, 2.0, 0.0]), goal=np.array([-2.0, 2.0]))
    people = np.repeat(np.array([[[1.0, 2.0, 0.0], [1.0, -1.0, np.pi]]]), ROWS, axis=0)
    people[:, 1, 0] += 0.5 * AGES
    robot = np.repeat(layout.robot_pose[None], ROWS, axis=0)
    robot[:, 0] -= 0.1 * AGES
    script = Script(
        robot_poses=robot,
        commands=np.tile([0.1, 0.0, 0.0], (ROWS - 1, 1)),
        people_poses=people,
        velocities=np.array([[0.0, 0.0, 0.0], [-0.5, 0.0, 0.0]]),
        speeds=np.array([np.nan, 0.5]),
        routes=np.array([np.full((len(route), 2), np.nan), route]),
        delays=np.array([0.0, delay]),
        endings=np.array([Ending.STAND, ending]),
    )
    return replace(layout, people_poses=people[-1], interaction_pairs=np.zeros((0, 2), dtype=np.int64),
                   interaction_relations=(), script=script)  # fmt: skip


def begin(layout: Layout) -> Episode:
    return Episode(World(layout, CONFIG, np.random.default_rng(0)), CONFIG, judged=True)


def paths(episode: Episode, steps: int) -> np.ndarray:
    """Where the walker is after each step."""
    places = []
    for _ in range(steps):
        episode.advance(np.zeros(3))
        episode.conclude(None)
        places.append(episode.world.people_poses[1, :2])
    return np.array(places)


def test_the_warm_up_is_what_the_script_tells() -> None:
    episode = begin(scripted())
    world = episode.world
    assert world.time == 0
    np.testing.assert_array_equal(world.people_poses, world.layout.people_poses)
    np.testing.assert_allclose(world.people_velocities[1], [-0.5, 0, 0], atol=1e-12)
    np.testing.assert_allclose(world.robot_velocity, [0.1, 0, 0], atol=1e-12)
    assert len(episode.window()) == 3

    seen = episode._recorder.snapshots  # type: ignore[union-attr]
    np.testing.assert_allclose([each.robot_pose[0] for each in seen], -0.1 * AGES, atol=1e-12)
    np.testing.assert_allclose(seen[-1].people.velocities[1], [-0.6, 0, 0], atol=1e-12)
    assert seen[-1].command.tolist() == [0.1, 0.0, 0.0]


def test_a_walker_goes_on_at_their_speed_along_their_route_and_stays() -> None:
    places = paths(begin(scripted(route=((-1.0, -1.0), (-1.0, 1.0)))), 60)
    np.testing.assert_allclose(places[4], [0.5, -1.0], atol=0.06)
    assert places[:, 0].min() < -0.4  # towards the first place before the second
    np.testing.assert_allclose(places[-1], [-1.0, 1.0], atol=0.2)
    np.testing.assert_allclose(places[-1], places[-5], atol=0.01)


def test_who_waits_sets_out_later() -> None:
    places = paths(begin(scripted(delay=2.0)), 20)
    assert places[8, 0] > 0.75
    assert places[19, 0] < 0.5


def test_a_route_can_be_walked_again_and_again() -> None:
    places = paths(begin(scripted(route=((-1.0, -1.0), (1.0, -1.0)), ending=Ending.REPEAT)), 80)
    turns = np.abs(np.diff(np.sign(np.diff(places[:, 0])))).sum() / 2
    assert turns >= 3


def test_who_wanders_afterwards_chooses_places_of_their_own() -> None:
    episode = begin(scripted(route=((0.2, -1.0),), ending=Ending.WANDER))
    paths(episode, 1)
    assert episode.world.people_targets[1].tolist() == [0.2, -1.0]
    paths(episode, 20)
    assert episode.world.people_targets[1].tolist() != [0.2, -1.0]


@pytest.fixture
def recording() -> Recording:
    episode = begin(scripted())
    paths(episode, 15)
    state = dict(episode.world.random_state)
    return Recording(episode.trajectory(), CONFIG, state, None, simulation_versions())


def test_a_recording_carries_the_script_and_replays(recording: Recording, tmp_path: Path) -> None:
    write_recording(recording, tmp_path / "scripted.npz")
    read = read_recording(tmp_path / "scripted.npz")
    for name in SCRIPT_ARRAYS:
        one, other = (
            getattr(each.trajectory.layout.script, name.removeprefix("script_")) for each in (recording, read)
        )
        np.testing.assert_array_equal(one, other, strict=True)
    assert first_difference(read.trajectory, replay(read)) is None


def test_without_the_robot_people_do_what_the_script_says(recording: Recording) -> None:
    alone = rerun_without_robot(recording)
    np.testing.assert_array_equal(alone.people_poses, recording.trajectory.people_poses)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"commands": np.zeros((3, 3)), "robot_poses": np.zeros((4, 3)), "people_poses": np.zeros((4, 2, 3))},
         "script_commands must be 10 as config says, got 3"),
        ({"endings": np.array([0, 7])}, "script_endings must be 0 to 2, got 7"),
        ({"speeds": np.zeros(3)}, r"script_speeds must have shape \(2\), got \(3,\)"),
    ],
)  # fmt: skip
def test_scripts_that_cannot_be_are_refused(recording: Recording, tmp_path: Path, changes, message: str) -> None:
    layout = recording.trajectory.layout
    script = replace(layout.script, **changes)
    trajectory = replace(recording.trajectory, layout=replace(layout, script=script))
    write_recording(replace(recording, trajectory=trajectory), tmp_path / "bad.npz")
    with pytest.raises(RecordingError, match=message):
        read_recording(tmp_path / "bad.npz")
