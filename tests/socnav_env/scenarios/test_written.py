"""Scenario files: what they say is what stands there, and what is wrong in them is said in a line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from socnav_env.commands.main import main
from socnav_env.config import AT_LAPTOP, TALKING, WALKING_TOGETHER, ConfigError, EnvConfig
from socnav_env.env import SocNavEnv
from socnav_env.layout import Ending, Layout, ObjectKind
from socnav_env.scenarios.written import WrittenScenario

START = "version: 1\nroom: {size: [8, 6]}\nrobot: {at: [-3, 0]}\ngoal: {at: [3, 0]}\n"


def scene(text: str, start: str = START) -> WrittenScenario:
    return WrittenScenario.from_text(start + text, "test", "test.yaml")


def drawn(text: str, seed: int = 0, start: str = START) -> Layout:
    written = scene(text, start)
    return written.draw(written.adapt(EnvConfig()), np.random.default_rng(seed))


def test_the_least_a_file_can_say() -> None:
    layout = drawn("")
    assert layout.room.corners.tolist() == [[-4, -3], [4, -3], [4, 3], [-4, 3]]
    assert layout.robot_pose.tolist() == [-3, 0, 0]  # towards the goal
    assert layout.goal.tolist() == [3, 0]
    assert (layout.num_people, layout.num_objects) == (0, 0)


def test_people_things_and_what_they_do_together() -> None:
    layout = drawn(
        """
people:
  - {name: anna, at: [1, 2]}
  - {name: ben, at: [2.5, 2]}
  - {name: cleo, at: [0, -1], heading: desk}
  - {at: [-1, 2], heading: 0.5}
objects:
  - {name: desk, kind: desk, at: [0, -2.5], heading: 1.5}
  - {kind: plant, at: [-3.5, 2.5], size: [0.3, 0.3]}
interactions:
  - {between: [anna, ben]}
  - {between: [desk, cleo]}
"""
    )
    np.testing.assert_allclose(layout.people_poses, [[1, 2, 0], [2.5, 2, np.pi], [0, -1, -np.pi / 2], [-1, 2, 0.5]])
    assert not layout.people_walk.any()
    assert layout.object_kinds.tolist() == [ObjectKind.TABLE, ObjectKind.LAPTOP, ObjectKind.PLANT]
    assert layout.object_poses[1].tolist() == [0, -2.5, 1.5]
    assert layout.object_sizes.tolist() == [[0.9, 0.8], [0.9, 0.8], [0.3, 0.3]]
    assert layout.interaction_pairs.tolist() == [[0, 1], [2, 5]]  # four people, then the table and its laptop
    assert layout.interaction_relations == (TALKING, AT_LAPTOP)


def test_walkers_are_under_way_when_the_episode_begins() -> None:
    layout = drawn("people:\n  - {at: [2, 1], route: [[-2, 1], [-2, 2]], speed: 0.5, then: repeat}\n")
    script = layout.script
    assert layout.people_walk.tolist() == [True]
    np.testing.assert_allclose(script.people_poses[:, 0, 0], 2 + 0.1 * np.arange(10, -1, -1))
    np.testing.assert_allclose(script.velocities, [[-0.5, 0, 0]], atol=1e-12)
    assert script.routes.tolist() == [[[-2, 1], [-2, 2]]]
    assert script.endings.tolist() == [Ending.REPEAT]


def test_who_starts_at_a_wall_has_not_come_through_it() -> None:
    script = drawn("people:\n  - {at: [3.7, 1], route: [[-2, 1]], speed: 0.5}\n").script
    assert script.people_poses[..., 0].max() <= 4 - 0.25


def test_who_waits_stands_until_then() -> None:
    script = drawn("people:\n  - {at: [2, 1], route: [[-2, 1]], speed: 0.5, delay: 3}\n").script
    assert not script.velocities.any()
    assert (script.people_poses == script.people_poses[0]).all()


def test_companions_share_a_route() -> None:
    layout = drawn("people:\n  - {name: a, at: [2, 0.3], route: [[-2, 0]], speed: 0.6}\n  - {at: [2, -0.3], with: a}\n")
    assert layout.people_group.tolist() == [0, 0]
    assert layout.script.routes[0].tolist() == layout.script.routes[1].tolist()
    np.testing.assert_allclose(layout.people_poses[:, 2], np.pi, atol=1e-12)
    assert layout.interaction_relations == (WALKING_TOGETHER,)


def test_ranges_counts_and_jitter_are_drawn_anew_for_every_seed() -> None:
    text = "people:\n  - {count: [2, 5], at: [[-2, 2], [-2, 2]], does: wander, speed: [0.4, 0.6]}\n"
    layouts = [drawn(text, seed) for seed in range(20)]
    assert {layout.num_people for layout in layouts} == {2, 3, 4, 5}
    places = np.vstack([layout.people_poses[:, :2] for layout in layouts])
    assert np.abs(places).max() <= 2
    assert np.ptp(places, axis=0).min() > 3
    speeds = np.concatenate([layout.script.speeds for layout in layouts])
    assert 0.4 <= speeds.min() < speeds.max() <= 0.6
    far = START.replace("at: [-3, 0]", "at: [-2, 0], jitter: 0.5")
    moved = np.array([drawn("", seed, far).robot_pose[:2] for seed in range(50)]) - [-2, 0]
    assert 0.4 < np.hypot(*moved.T).max() <= 0.5


def test_a_room_can_be_drawn_from_ranges_corners_or_walls() -> None:
    sized = drawn("", 1, START.replace("[8, 6]", "[[8, 9], 6]")).room.corners
    assert 8 < np.ptp(sized[:, 0]) < 9
    corners = "room: {corners: [[-4, 3], [4, 3], [4, -3], [-4, -3]]}"  # clockwise
    walls = "room: {walls: [[-4, -3, 4, -3], [4, -3, 4, 3], [4, 3, -4, 3], [-4, 3, -4, -3]]}"
    for text in (corners, walls):
        room = drawn("", 0, START.replace("room: {size: [8, 6]}", text)).room.corners
        x, y = room.T
        assert np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)) == 96  # counter-clockwise


def test_settings_are_taken_over() -> None:
    config = scene("time_limit: 30\nconfig: {people: {stop_distance: 0.5}}\n").adapt(EnvConfig(warm_up=1.0))
    assert (config.time_limit, config.people.stop_distance, config.warm_up) == (30.0, 0.5, 1.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("peple: []", "unknown field peple; the valid ones are version, description, room, robot, goal, people"),
        ("people:\n  - {at: [0, 0], sped: 1}", "people[0]: unknown field sped; the valid ones are name, count, at"),
        ("people:\n  - {name: a}", "people[0].at is missing"),
        ("people:\n  - {at: [0]}", "people[0].at must be a point [x, y], each a number or a range"),
        ("people:\n  - {at: [0, high]}", "people[0].at[1] must be a number, got 'high'"),
        ("people:\n  - {at: [0, .nan]}", "people[0].at[1] must be a number, got nan"),
        ("people:\n  - {at: [[2, 1], 0]}", "people[0].at[0] must be a range that rises, [least, most], got [2, 1]"),
        ("people:\n  - {at: [0, 1], does: walk}", "people[0].route is missing, who walks needs one"),
        ("people:\n  - {at: [0, 1], does: fly}", "people[0].does must be one of stand, walk, wander, got 'fly'"),
        ("people:\n  - {at: [0, 1], speed: 1}", "people[0].speed needs somebody who walks or wanders, got 1"),
        ("people:\n  - {at: [0, 1], route: [[1, 1]], speed: 9}", "people[0].speed must be from 0.1 to 2, got 9"),
        ("people:\n  - {at: [0, 1], delay: 1}", "people[0].delay needs a route"),
        ("people:\n  - {at: [0, 1], with: a}", "people[0].with must name one of none: give people"),
        ("people:\n  - {at: [0, 1], heading: moon}", "people[0].heading must name one of goal, robot; got 'moon'"),
        ("people:\n  - {at: [0, 1], count: 1.5}", "people[0].count must be whole, got 1.5"),
        ("people:\n  - {at: [0, 1], count: 2, name: a}", "people[0].name must be of a single person"),
        ("people:\n  - {at: [0, 1], name: goal}", "people[0].name must be its own, got 'goal' again"),
        ("people: 3", "people must be a list, got 3"),
        ("people:\n  - 3", "people[0] must be fields and their values, got 3"),
        ("objects:\n  - {at: [0, 0]}", "objects[0].kind is missing"),
        ("objects:\n  - {at: [0, 0], kind: cat}", "objects[0].kind must be one of table, desk, plant, got 'cat'"),
        ("interactions:\n  - {between: [a, b]}", "interactions[0].between must name one of none"),
        ("people:\n  - {at: [5, 0]}", "people[0] must be inside the room, got (5.00, 0.00)"),
        ("people:\n  - {at: [3.9, 1]}", "people[0] must be at least 0.25 m from the walls, got (3.90, 1.00)"),
        ("people:\n  - {at: [0, 1], name: a}\n  - {at: [0.2, 1]}", "people[1] must not overlap people[0] (a)"),
        ("people:\n  - {at: [-2.9, 0]}", "robot must not overlap people[0], got (-3.00, 0.00)"),
        ("people:\n  - {at: [0, 1], route: [[9, 9]]}", "people[0].route[0] must be inside the room"),
        ("objects:\n  - {at: [3.9, 0], kind: table}", "objects[0] must stand inside the room, got (3.90, 0.00)"),
        ("objects:\n  - {at: [3, 0], kind: table}", "goal must not overlap objects[0]"),
        (
            "objects:\n  - {at: [0, 0], kind: table}\n  - {at: [0.5, 0], kind: plant}",
            "objects[1] must not overlap objects[0]",
        ),
        ("objects:\n  - {at: [0, 0], kind: table, size: [1, 5.9]}", "goal must be within the robot's reach"),
        ("time_limit: 0", "time_limit must be from 0.1 to 600, got 0"),
        ("time_limit: 9.9", "config: time_limit must be a whole number of control periods"),
        ("config: {speed: 3}", "config: unknown key speed"),
        ("config: 3", "config must be fields and their values"),
        ("people: [", "line 5, column 10: must be YAML: "),
        ("version: 1", "line 5, column 1: must be YAML: field version stands here twice"),
        ("? [a]\n: b", "must be YAML: "),
    ],
)
def test_what_is_wrong_is_said_in_a_line(text: str, message: str) -> None:
    with pytest.raises(ConfigError) as refused:
        drawn(text)
    assert str(refused.value).startswith("test.yaml: ")
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("version: 1", "version: 2", "version must be 1, the format that this version reads, got 2"),
        ("version: 1\n", "", "version is missing"),
        ("room: {size: [8, 6]}\n", "", "room is missing"),
        ("{size: [8, 6]}", "{}", "room must have one of size, corners and walls"),
        ("{size: [8, 6]}", "{size: [8, true]}", "room.size[1] must be a number, got True"),
        ("{size: [8, 6]}", "{corners: [[0, 0], [1, 1]]}", "room.corners must be at least three points"),
        ("{size: [8, 6]}", "{corners: [[-4, -3], [4, 3], [4, -3], [-4, 3]]}", "walls 0 and 2 do"),
        ("{size: [8, 6]}", "{corners: [[0, 0], [1, 0], [0, 1]]}", "room: must have at least 1 m^2, got 0.5"),
        ("{size: [8, 6]}", "{walls: [[-4, -3, 4, -3], [4, -3, 4, 3], [4, 3, -4, -2]]}",
         "room.walls must close, but wall 2 ends at (-4, -2) and wall 0 begins at (-4, -3)"),
        ("goal: {at: [3, 0]}", "goal: {at: [-2.6, 0]}", "robot.at must be farther than 0.5 m from the goal"),
        ("goal: {at: [3, 0]}", "goal: {at: [3.9, 0]}", "goal must be at least 0.25 m from the walls"),
        (START, "", "must be fields and their values, got None"),
    ],
)  # fmt: skip
def test_rooms_robots_and_goals_that_cannot_be(old: str, new: str, message: str) -> None:
    with pytest.raises(ConfigError) as refused:
        drawn("", 0, START.replace(old, new))
    assert message in str(refused.value)


def test_a_file_of_ones_own_is_found_and_a_missing_one_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(START + "time_limit: 1\n")
    env = SocNavEnv("sparse", scenario=file)
    env.reset(seed=0)
    assert env.scenario.name == "mine"
    picture = tmp_path / "mine.png"
    arguments = ["render", str(picture), "--reward", "sparse", "--driver", "stander", "--scenario"]
    assert main([*arguments, str(file)]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    capsys.readouterr()
    assert main([*arguments, str(tmp_path / "gone.yaml")]) == 2
    assert (
        capsys.readouterr().err == f"socnav_env: {tmp_path / 'gone.yaml'}: cannot read it: No such file or directory\n"
    )


def test_what_never_fits_is_said_when_the_environment_is_made(tmp_path: Path) -> None:
    file = tmp_path / "full.yaml"
    file.write_text(START + "people:\n  - {count: 50, at: [[-1, 1], [-1, 1]]}\n")
    with pytest.raises(ConfigError, match=r"full.yaml: people\[0\] must not overlap people\[0\]"):
        SocNavEnv("sparse", scenario=file)
