import copy
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reward_model.scenes.scene import ScenarioError
from reward_model.scenes.socnav2_json import parse_socnav2, read_socnav2, socnav2_document
from tests.reward_model.example_scenes import hand_made_document

MISTAKES = {
    "no list": (lambda d: {"snapshots": d}, 'hand.json: must be a list of snapshots, got {"snapshots": '),
    "empty list": (lambda d: [], "hand.json: must be a list of at least one snapshot, got an empty one"),
    "snapshot is no object": (lambda d: [3], "hand.json: snapshot 0: must be a JSON object, got 3"),
    "missing key": (lambda d: d[1].pop("goal") and d, "hand.json: snapshot 1: goal is missing"),
    "missing number": (
        lambda d: d[1]["people"][1].pop("vx") is None or d,
        "hand.json: snapshot 1: people[1].vx is missing",
    ),
    "text for a number": (
        lambda d: d[1]["people"][1].update(vx="a") or d,
        'hand.json: snapshot 1: people[1].vx must be a finite number, got "a"',
    ),
    "true for a number": (
        lambda d: d[0]["walls"][1].update(x2=True) or d,
        "hand.json: snapshot 0: walls[1].x2 must be a finite number, got true",
    ),
    "not a number": (
        lambda d: d[0]["goal"][0].update(y=math.nan) or d,
        "hand.json: snapshot 0: goal[0].y must be a finite number, got NaN",
    ),
    "infinite": (
        lambda d: d[0]["objects"][0].update(a=math.inf) or d,
        "hand.json: snapshot 0: objects[0].a must be a finite number, got Infinity",
    ),
    "too large for a float": (
        lambda d: d[0]["command"].__setitem__(0, 10**400) or d,
        "hand.json: snapshot 0: command[0] must be a finite number, got 10000",
    ),
    "short command": (
        lambda d: d[0].update(command=[1.0, 2.0]) or d,
        "hand.json: snapshot 0: command must hold 3 numbers, got 2",
    ),
    "people are no list": (
        lambda d: d[0].update(people={"id": 1}) or d,
        'hand.json: snapshot 0: people must be a list, got {"id": 1}',
    ),
    "two goals": (
        lambda d: d[0]["goal"].append({"x": 0, "y": 0}) or d,
        "hand.json: snapshot 0: goal must be a list of one point, got 2",
    ),
    "no goal": (
        lambda d: d[0].update(goal=[]) or d,
        "hand.json: snapshot 0: goal must be a list of one point, got 0",
    ),
    "id twice among people": (
        lambda d: d[1]["people"][1].update(id=1) or d,
        "hand.json: snapshot 1: people[1].id must differ from people[0].id, "
        "ids of people and objects are unique, got 1",
    ),
    "id of a person used by an object": (
        lambda d: d[1]["objects"][0].update(id=1) or d,
        "hand.json: snapshot 1: objects[0].id must differ from people[0].id, "
        "ids of people and objects are unique, got 1",
    ),
    "id is no integer": (
        lambda d: d[1]["objects"][0].update(id=1.5) or d,
        "hand.json: snapshot 1: objects[0].id must be an integer, got 1.5",
    ),
    "id of nobody": (
        lambda d: d[0]["interaction"][0].update(dst=9) or d,
        "hand.json: snapshot 0: interaction[0].dst must be the id of a person or an object in the scene, got 9",
    ),
    "interaction with oneself": (
        lambda d: d[0]["interaction"][0].update(dst=2) or d,
        "hand.json: snapshot 0: interaction[0].dst must differ from the other end of the interaction, got 2",
    ),
    "relation is no text": (
        lambda d: d[0]["interaction"][0].update(relation=None) or d,
        "hand.json: snapshot 0: interaction[0].relation must be a string, got null",
    ),
    "negative size": (
        lambda d: d[1]["objects"][0].update(size_y=-0.1) or d,
        "hand.json: snapshot 1: objects[0].size_y must not be negative, got -0.1",
    ),
    "time stands still": (
        lambda d: d[1].update(timestamp=10.0) or d,
        "hand.json: snapshot 1: timestamp must be later than 10.0 of the snapshot before, got 10.0",
    ),
    "time runs back": (
        lambda d: d[1].update(timestamp=9) or d,
        "hand.json: snapshot 1: timestamp must be later than 10.0 of the snapshot before, got 9",
    ),
    "interval of zero": (
        lambda d: d[1].update(interval=0) or d,
        "hand.json: snapshot 1: interval must be positive, got 0",
    ),
    "two recordings in one": (
        lambda d: d[1].update(ID="other") or d,
        'hand.json: snapshot 1: ID must be "made_by_hand" as in the first snapshot, got "other"',
    ),
    "broken pose": (
        lambda d: d[1]["robot_pose"].pop("a") and d,
        "hand.json: snapshot 1: robot_pose.a is missing",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_named_with_its_place_and_remedy(mistake):
    make, message = MISTAKES[mistake]
    with pytest.raises(ScenarioError) as caught:
        parse_socnav2(make(hand_made_document()), "hand.json")
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


def test_a_velocity_that_overflows_is_refused():
    document = hand_made_document()
    document[1].update(interval=1e-10)
    document[1]["people"][0].update(vx=1e300)
    with pytest.raises(ScenarioError, match=r"^hand\.json: made_by_hand: snapshot 1: people velocities must be finite"):
        parse_socnav2(document, "hand.json")


def test_two_objects_cannot_interact():
    document = hand_made_document()
    document[0]["objects"].append({**document[0]["objects"][0], "id": 8})
    document[0]["interaction"][0].update(src=7, dst=8)
    with pytest.raises(ScenarioError, match=r"interaction\[0\]\.dst must be a person, .*got 8$"):
        parse_socnav2(document, "hand.json")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ScenarioError, match=r"absent\.json: cannot read it: No such file or directory$"):
        read_socnav2(tmp_path / "absent.json")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b'[\n {"ID": 1,,}]', r"scene\.json: line 2, column 11: must be JSON: "),
        (b"", r"scene\.json: line 1, column 1: must be JSON: "),
        (b"[" * 100_000, r"scene\.json: line 1: must be JSON that is not nested this deeply$"),
        (b'["\xff"]', r"scene\.json: must be UTF-8 text, byte 2 is not$"),
    ],
)
def test_broken_files_are_named(tmp_path, content, message):
    path = tmp_path / "scene.json"
    path.write_bytes(content)
    with pytest.raises(ScenarioError, match=message):
        read_socnav2(path)


def places(value, path=()):
    """Every place in a document, as a path of keys and indices."""
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from places(item, (*path, key))


def altered(path, value):
    document = hand_made_document()
    if not path:
        return value
    *way, last = path
    parent = document
    for key in way:
        parent = parent[key]
    parent[last] = copy.deepcopy(value)
    return document


JSON_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=5,
)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(path=st.sampled_from(list(places(hand_made_document()))), value=JSON_VALUES)
def test_any_altered_document_is_read_or_refused_in_one_line(path, value):
    try:
        sequence = parse_socnav2(altered(path, value), "hand.json")
    except ScenarioError as error:
        assert str(error).startswith("hand.json: ")
        assert "\n" not in str(error)
    else:
        assert len(parse_socnav2(socnav2_document(sequence), "copy")) == len(sequence)
