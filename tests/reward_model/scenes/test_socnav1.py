import copy
import json
import math

import numpy as np
import pytest
from scipy.stats import spearmanr

from reward_model import load_scorer
from reward_model.scenes.scene import ScenarioError
from reward_model.scenes.socnav1 import read_socnav1

RATING = {
    "score": 58,
    "identifier": "08093 B",
    "room": [[-300, -500], [-300, 100], [400, 100], [400, -500], [-300, -500]],
    "humans": [
        {"id": 1, "xPos": 100, "yPos": -200, "orientation": 0},
        {"id": 2, "xPos": -50, "yPos": -200, "orientation": 90},
    ],
    "objects": [{"id": 3, "xPos": 0, "yPos": 50, "orientation": -45.0}],
    "links": [[1, 2, "interact"], [2, 1, "interact"], [2, 3, "interact"]],
    "robot": {"id": 0},
    "rater": "b",
}


def write_ratings(path, *ratings):
    path.write_text("".join(f"{json.dumps(rating)}\n" for rating in ratings))
    return path


def test_a_hand_made_rating(tmp_path):
    (labelled,) = read_socnav1(write_ratings(tmp_path / "ratings.jsonl", RATING))
    assert (labelled.q1, labelled.q2, labelled.scene, labelled.rater) == (0.58, None, "08093", "b")
    assert [snapshot.timestamp for snapshot in labelled.sequence] == [0.0, 1.0, 2.0]
    for snapshot in labelled.sequence:
        # forward is -yPos, left is -xPos; orientation 90 looks to the right
        np.testing.assert_allclose(snapshot.people.poses, [[2, -1, 0], [2, 0.5, -math.pi / 2]])
        np.testing.assert_allclose(snapshot.objects.poses, [[-0.5, 0, math.pi / 4]])
        np.testing.assert_allclose(snapshot.objects.sizes, [[0.4, 0.4]])
        assert not snapshot.people.velocities.any() and not snapshot.objects.velocities.any()
        assert not snapshot.command.any() and not snapshot.goal.any()
        assert snapshot.interactions.pairs.tolist() == [[1, 2], [2, 3]]
        assert snapshot.interactions.relations == ("interact", "interact")


def test_walls_run_clockwise_whichever_way_the_room_was_drawn(tmp_path):
    backwards = {**RATING, "room": RATING["room"][::-1]}
    walls = [[5, 3, 5, -4], [5, -4, -1, -4], [-1, -4, -1, 3], [-1, 3, 5, 3]]
    for labelled in read_socnav1(write_ratings(tmp_path / "ratings.jsonl", RATING, backwards)):
        np.testing.assert_allclose(labelled.sequence.last.walls, walls)


def test_ratings_keep_the_file_order_and_empty_lines_are_skipped(tmp_path):
    path = write_ratings(tmp_path / "ratings.jsonl", RATING)
    path.write_text(path.read_text() + "\n" + json.dumps({**RATING, "identifier": "00007 A", "score": 100}))
    assert [(r.scene, r.q1) for r in read_socnav1(path)] == [("08093", 0.58), ("00007", 1.0)]


MISTAKES = {
    "missing": (lambda r: r.pop("score") and r, "score is missing"),
    "score too high": (lambda r: r.update(score=101) or r, "score must lie within 0..100, got 101"),
    "no number": (lambda r: r.update(identifier="B") or r, "identifier must contain the number of the scene"),
    "text": (
        lambda r: r["humans"][1].update(xPos="a") or r,
        'humans[1].xPos must be a finite number, got "a"',
    ),
    "open room": (lambda r: r["room"].pop() and r, "room must be a closed polygon"),
    "flat room": (lambda r: r.update(room=[[0, 0], [1, 0], [0, 0]]) or r, "room must be a closed polygon"),
    "point": (lambda r: r["room"].insert(1, [1]) or r, "room[1] must hold 2 numbers, got 1"),
    "id twice": (lambda r: r["objects"][0].update(id=1) or r, "objects[0].id must differ from humans[0].id"),
    "unknown id": (
        lambda r: r["links"].append([1, 9, "interact"]) or r,
        "links[3][1] must be the id of a person or an object in the scene, got 9",
    ),
    "short link": (lambda r: r["links"].append([1, 2]) or r, "links[3] must be [id, id, relation], got [1, 2]"),
    "no object": (lambda r: 5, "must be a JSON object, got 5"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_named_with_its_line(tmp_path, mistake):
    make, message = MISTAKES[mistake]
    path = write_ratings(tmp_path / "ratings.jsonl", RATING, make(copy.deepcopy(RATING)))
    with pytest.raises(ScenarioError) as caught:
        read_socnav1(path)
    assert str(caught.value).startswith(f"{path}: line 2: {message}")
    assert "\n" not in str(caught.value)


def test_broken_lines_empty_files_and_missing_files_are_named(tmp_path):
    path = tmp_path / "ratings.jsonl"
    path.write_text(json.dumps(RATING) + '\n{"score": }\n')
    with pytest.raises(ScenarioError, match=r"ratings\.jsonl: line 2, column 11: must be JSON: "):
        read_socnav1(path)
    path.write_text("\n")
    with pytest.raises(ScenarioError, match=r"must hold at least one rating, one a line, got none$"):
        read_socnav1(path)
    with pytest.raises(ScenarioError, match=r"absent\.jsonl: cannot read it: "):
        read_socnav1(tmp_path / "absent.jsonl")


def test_every_shared_rating_is_read(shared_data):
    ratings = read_socnav1(shared_data / "socnav1" / "dev.jsonl")
    assert len(ratings) == 1092
    assert (ratings[0].scene, ratings[0].rater, ratings[0].q1) == ("08093", "a", 0.58)
    assert len(ratings[0].sequence.last.people) == 13


def test_the_published_network_agrees_with_people_as_far_as_it_is_known_to(shared_data, published_weights):
    """SocNav1's held-out part: MSE 0.044, rank correlation 0.81."""
    ratings = read_socnav1(shared_data / "socnav1" / "dev.jsonl")
    people = np.array([rating.q1 for rating in ratings])
    network = load_scorer("published").score_batch([rating.sequence for rating in ratings])[:, 0]
    assert np.mean((network - people) ** 2) < 0.044
    assert spearmanr(network, people).statistic > 0.80
