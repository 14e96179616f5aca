from collections import Counter

import numpy as np
import pytest

from benchmarks.robustness.clearance import clearance, in_contact
from benchmarks.robustness.scenes import KINDS, ORDINARY, described, kind_of, odd_scene
from reward_model.scenes.socnav2_json import encode_socnav2, read_socnav2

NUMBER = 120


@pytest.fixture(scope="module")
def scenes():
    return [odd_scene(3, index) for index in range(NUMBER)]


def test_kinds_take_turns_and_scenes_are_named_by_them(scenes):
    assert Counter(kind_of(index) for index in range(NUMBER)) == dict.fromkeys(KINDS, NUMBER // 4)
    assert [scene.name for scene in scenes[:5]] == ["room 0", "contact 1", "extreme 2", "limits 3", "room 4"]


def test_a_scene_depends_on_its_seed_and_number_alone(scenes):
    for index in (83, 2, 41, 40):
        assert encode_socnav2(odd_scene(3, index)) == encode_socnav2(scenes[index])
        assert encode_socnav2(odd_scene(4, index)) != encode_socnav2(scenes[index])


def test_the_reader_accepts_every_scene(scenes, tmp_path):
    for scene in scenes:
        (tmp_path / "scene.json").write_bytes(encode_socnav2(scene))
        read = read_socnav2(tmp_path / "scene.json")
        assert [len(snapshot.people) for snapshot in read] == [len(snapshot.people) for snapshot in scene]
        np.testing.assert_array_equal(read.last.walls, scene.last.walls)


def test_ordinary_scenes_are_rooms_and_half_of_them_touch(scenes):
    ordinary = [scene for scene in scenes if scene.name.split()[0] in ORDINARY]
    for scene in ordinary:
        assert np.abs(scene.last.walls).max() < 40
        assert len(scene.last.people) <= 30
        assert np.abs(scene.last.command).max() <= 1
    against = [scene.last for scene in ordinary if scene.name.startswith("contact")]
    assert 0.4 < np.mean([in_contact(snapshot) for snapshot in against]) < 0.9
    # The others are near: 0.3 m of free space to what the robot was put against.
    assert max(clearance(snapshot) for snapshot in against) < 0.31


def test_the_others_go_far_beyond_sense(scenes):
    beyond = [scene for scene in scenes if scene.name.split()[0] not in ORDINARY]
    newest = [scene.last for scene in beyond]
    assert min(len(each.walls) for each in newest) == 0
    assert max(len(each.walls) for each in newest) > 1000
    assert max(len(each.people) for each in newest) > 100
    assert max(np.abs(each.goal).max() for each in newest) > 1e5
    assert max(each.objects.sizes.max(initial=0) for each in newest) >= 5e5
    assert max(len(each.interactions) for each in newest) > 300
    assert min(each.interval for each in newest) < 1e-4
    assert {len(scene) for scene in beyond} == {1, 2, 3, 12, 40}
    assert any(len(scene.snapshots[0].people) != len(scene.last.people) for scene in beyond)
    numbers = np.concatenate([np.abs(array).ravel() for each in newest for array in arrays_of(each)])
    assert ((numbers > 0) & (numbers < 1e-300)).any()
    assert numbers.max() == 1e307


def arrays_of(snapshot):
    people, objects = snapshot.people, snapshot.objects
    return (people.poses, people.velocities, objects.poses, objects.velocities, objects.sizes, snapshot.walls)


def test_a_scene_is_described_in_a_line(scenes):
    for scene in scenes:
        assert described(scene).count("\n") == 0
    assert described(scenes[1]).startswith(f"{len(scenes[1])} snapshots; {len(scenes[1].last.people)} people; ")
