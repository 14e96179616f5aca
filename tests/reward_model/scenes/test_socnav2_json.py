import json
import math
from dataclasses import replace

import numpy as np
import pytest

from reward_model.scenes.scene import LabelledSequence, ScenarioError, SceneSequence
from reward_model.scenes.socnav2_json import (
    parse_labelled_socnav2,
    parse_socnav2,
    read_labelled_socnav2,
    read_socnav2,
    socnav2_document,
    write_socnav2,
)
from tests.reward_model.example_scenes import hand_made_document

SAMPLES = ("S1_000000", "S1_000003", "S2F_000000", "S2_000000", "S3I_000000", "S3nI_000000")


def assert_same_json(first, second, place=""):
    """Numbers to 1e-9, everything else exactly; the order of keys does not matter."""
    if isinstance(first, dict):
        assert isinstance(second, dict) and first.keys() == second.keys(), place
        for key in first:
            assert_same_json(first[key], second[key], f"{place}.{key}")
    elif isinstance(first, list):
        assert isinstance(second, list) and len(first) == len(second), place
        for index, (one, other) in enumerate(zip(first, second, strict=True)):
            assert_same_json(one, other, f"{place}[{index}]")
    elif isinstance(first, float):
        assert first == pytest.approx(second, abs=1e-9, rel=0), place
    else:
        assert type(first) is type(second) and first == second, place


def assert_same_sequence(first: SceneSequence, second: SceneSequence):
    assert first.name == second.name
    for one, other in zip(first, second, strict=True):
        assert one.timestamp == other.timestamp
        assert one.interval == pytest.approx(other.interval, abs=1e-9)
        assert one.people.ids.tolist() == other.people.ids.tolist()
        assert one.objects.ids.tolist() == other.objects.ids.tolist()
        assert one.interactions.pairs.tolist() == other.interactions.pairs.tolist()
        assert one.interactions.relations == other.interactions.relations
        for name in ("command", "goal", "walls", "robot_pose"):
            np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=1e-9)
        for entities, others in ((one.people, other.people), (one.objects, other.objects)):
            np.testing.assert_allclose(entities.poses, others.poses, atol=1e-9)
            np.testing.assert_allclose(entities.velocities, others.velocities, atol=1e-9)
        np.testing.assert_allclose(one.objects.sizes, other.objects.sizes, atol=1e-9)


def test_conventions_of_a_hand_made_scene():
    first, second = parse_socnav2(hand_made_document(), "hand.json")
    assert (first.timestamp, first.interval) == (10.0, 0.2)
    assert (second.timestamp, second.interval) == (10.5, 0.5)
    np.testing.assert_allclose(second.command, [0.2, -0.1, -0.2])  # rot positive turns right
    np.testing.assert_allclose(second.goal, [3.0, -1.0])
    # a = 0 looks to the robot's right; growing a turns clockwise
    np.testing.assert_allclose(first.people.poses, [[2.0, -1.0, -math.pi / 2], [0.5, 2.0, 1.5 - math.pi / 2]])
    # 0.1 m to the right, 0.2 m back and 0.25 rad counter-clockwise in 0.5 s
    np.testing.assert_allclose(second.people.velocities, [[-0.4, -0.2, 0.5], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(first.objects.poses, [[-1.0, 0.0, -0.25 - math.pi / 2]])
    np.testing.assert_allclose(first.objects.sizes, [[0.5, 0.75]])
    np.testing.assert_allclose(first.walls, [[5.0, -4.0, -5.0, -4.0], [-5.0, -4.0, -5.0, 4.0]])
    np.testing.assert_allclose(first.robot_pose, [1.5, -0.5, -0.125])
    assert first.people.ids.tolist() == [1, 2]
    assert first.objects.ids.tolist() == [7]
    assert first.interactions.pairs.tolist() == [[2, 7]]
    assert first.interactions.relations == ("human_plant_interaction",)


def test_the_name_of_a_sequence_is_its_id():
    assert parse_socnav2(hand_made_document(), "hand.json").name == "made_by_hand"


@pytest.mark.parametrize("name", SAMPLES)
def test_json_to_sequence_to_json_is_the_identity(shared_data, tmp_path, name):
    path = shared_data / "socnav2_samples" / f"{name}.json"
    genuine = json.loads(path.read_text())
    sequence = read_socnav2(path)
    assert_same_json(genuine, socnav2_document(sequence))
    write_socnav2(sequence, tmp_path / "copy.json")
    assert_same_json(genuine, json.loads((tmp_path / "copy.json").read_text()))


@pytest.mark.parametrize("name", SAMPLES)
def test_velocities_are_the_rates_at_which_genuine_poses_change(shared_data, name):
    sequence = read_socnav2(shared_data / "socnav2_samples" / f"{name}.json")
    for before, now in zip(sequence.snapshots[:-1], sequence.snapshots[1:], strict=True):
        elapsed = now.timestamp - before.timestamp
        for entities, earlier in ((now.people, before.people), (now.objects, before.objects)):
            moved = entities.poses - earlier.poses
            moved[:, 2] = np.arctan2(np.sin(moved[:, 2]), np.cos(moved[:, 2]))
            turned = entities.velocities[:, 2] * elapsed
            np.testing.assert_allclose(entities.velocities[:, :2] * elapsed, moved[:, :2], atol=1e-5)
            np.testing.assert_allclose(np.sin(turned), np.sin(moved[:, 2]), atol=1e-5)


@pytest.mark.parametrize("name", SAMPLES)
def test_walls_stand_still_in_the_room_while_the_robot_drives(shared_data, name):
    sequence = read_socnav2(shared_data / "socnav2_samples" / f"{name}.json")
    corners = []
    for snapshot in sequence:
        x, y, heading = snapshot.robot_pose
        cos, sin = math.cos(heading), math.sin(heading)
        corners.append(snapshot.walls[:, :2] @ np.array([[cos, sin], [-sin, cos]]) + (x, y))
    # in one snapshot of S2F_000000 the pose was read a simulation step after the walls: 17 mm
    np.testing.assert_allclose(corners, np.broadcast_to(corners[0], np.shape(corners)), atol=0.02)


def test_sequence_to_json_to_sequence_is_the_identity():
    sequence = parse_socnav2(hand_made_document(), "hand.json")
    assert_same_sequence(sequence, parse_socnav2(socnav2_document(sequence), "copy"))


def test_an_interval_that_does_not_follow_from_timestamps_is_written():
    sequence = parse_socnav2(hand_made_document(), "hand.json")
    first, second = sequence
    assert all("interval" not in snapshot for snapshot in socnav2_document(sequence))
    simulated = replace(sequence, snapshots=(first, replace(second, interval=0.2)))
    document = socnav2_document(simulated)
    assert [snapshot.get("interval") for snapshot in document] == [None, 0.2]
    assert document[1]["people"][0]["vx"] == pytest.approx(-0.04)
    assert_same_sequence(simulated, parse_socnav2(document, "copy"))


def test_a_snapshot_without_people_objects_or_walls_survives():
    document = hand_made_document()
    for snapshot in document:
        snapshot.update(people=[], objects=[], walls=[], interaction=[])
        del snapshot["robot_pose"]
    sequence = parse_socnav2(document, "empty room")
    assert sequence.last.people.poses.shape == (0, 3)
    assert sequence.last.walls.shape == (0, 4)
    assert sequence.last.robot_pose is None
    assert_same_json(document, socnav2_document(sequence))


def test_a_pair_given_twice_or_both_ways_is_kept_once():
    document = hand_made_document()
    document[0]["interaction"] *= 2
    document[1]["interaction"].append({"src": 7, "dst": 2, "relation": "other"})
    for snapshot in parse_socnav2(document, "hand.json"):
        assert snapshot.interactions.pairs.tolist() == [[2, 7]]
        assert snapshot.interactions.relations == ("human_plant_interaction",)


def test_labels_come_from_the_newest_snapshot_that_has_them(tmp_path):
    document = hand_made_document()
    document[0].update(label_Q1=0, label_Q2=0)
    assert parse_labelled_socnav2(document, "hand.json").q1 == 0.0
    document[1].update(label_Q1=80, label_Q2=62.5)
    labelled = parse_labelled_socnav2(document, "hand.json")
    assert (labelled.q1, labelled.q2, labelled.scene) == (0.8, 0.625, "made_by_hand")
    write_socnav2(labelled, tmp_path / "labelled.json")
    again = read_labelled_socnav2(tmp_path / "labelled.json")
    assert (again.q1, again.q2, again.scene) == (0.8, 0.625, "made_by_hand")
    assert_same_sequence(again.sequence, labelled.sequence)


def test_one_label_is_enough_and_none_is_an_error():
    document = hand_made_document()
    with pytest.raises(ScenarioError, match=r"^hand\.json: no snapshot has a label_Q1 or label_Q2"):
        parse_labelled_socnav2(document, "hand.json")
    document[1]["label_Q2"] = 40
    labelled = parse_labelled_socnav2(document, "hand.json")
    assert (labelled.q1, labelled.q2) == (None, 0.4)
    assert "label_Q1" not in socnav2_document(labelled)[-1]
    document[1]["label_Q2"] = 101
    with pytest.raises(ScenarioError, match=r"snapshot 1: label_Q2 must lie within 0\.\.100, got 101$"):
        parse_labelled_socnav2(document, "hand.json")


def test_writing_replaces_a_file_and_leaves_nothing_else(tmp_path):
    path = tmp_path / "deep" / "scene.json"
    sequence = parse_socnav2(hand_made_document(), "hand.json")
    write_socnav2(sequence, path)
    write_socnav2(LabelledSequence(sequence, 1.0), path)
    assert read_labelled_socnav2(path).q1 == 1.0
    assert [file.name for file in path.parent.iterdir()] == ["scene.json"]
