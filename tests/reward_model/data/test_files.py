import json
from pathlib import Path

import pytest

from reward_model.data.examples import DatasetError
from reward_model.data.files import find_files, read_files
from reward_model.scenes.scene import ScenarioError
from tests.reward_model.example_scenes import hand_made_document
from tests.reward_model.scenes.test_socnav1 import RATING


def recording(path: Path, **labels) -> Path:
    document = hand_made_document()
    for snapshot in document:
        snapshot["ID"] = path.stem
    document[-1].update(labels or {"label_Q1": 80, "label_Q2": 40})
    path.write_text(json.dumps(document))
    return path


@pytest.fixture
def folder(tmp_path):
    for name in "abc":
        recording(tmp_path / f"{name}.json")
    return tmp_path


def names(paths) -> list[str]:
    return [path.name for path in paths]


def test_loose_files_are_not_split(folder):
    (folder / "ratings.jsonl").write_text(json.dumps(RATING))
    found = find_files(folder)
    assert list(found) == ["all"]
    assert names(found["all"]) == ["a.json", "b.json", "c.json", "ratings.jsonl"]
    assert find_files(folder / "a.json") == {"all": (folder / "a.json",)}


def test_split_lists_name_files_relative_to_themselves(folder):
    (folder / "more").mkdir()
    recording(folder / "more" / "d.json")
    (folder / "train_set.txt").write_text("c.json\n\nmore/d.json\r\n")
    (folder / "dev_set.txt").write_text("a.json")
    found = find_files(folder)
    assert {part: names(paths) for part, paths in found.items()} == {
        "train": ["c.json", "d.json"],
        "development": ["a.json"],
    }
    assert names(find_files(folder / "train_set.txt")["all"]) == ["c.json", "d.json"]


def test_rating_files_are_parts_by_their_names(shared_data):
    found = find_files(shared_data / "socnav1")
    assert {part: names(paths) for part, paths in found.items()} == {
        "train": ["train.jsonl"],
        "development": ["dev.jsonl"],
    }


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "must name at least one file, one a line, got none"),
        ("a.json\nb.json\na.json", "must name each file once, a.json is there 2 times"),
        ("a.json\nx.json", "names x.json, which {folder} does not hold"),
        ("x.json\ny.json\nz.json", "names x.json and 2 more, which {folder} does not hold"),
    ],
)
def test_mistakes_in_a_list(folder, content, message):
    path = folder / "train_set.txt"
    path.write_text(content)
    with pytest.raises(DatasetError) as caught:
        find_files(folder)
    assert str(caught.value) == f"{path}: {message.format(folder=folder)}"


def test_nothing_there(tmp_path):
    with pytest.raises(DatasetError, match=r"must hold recordings \(\*\.json\), ratings \(\*\.jsonl\) or split lists"):
        find_files(tmp_path)
    with pytest.raises(DatasetError, match=r"absent: data must be an existing file or folder$"):
        find_files(tmp_path / "absent")
    (tmp_path / "scores.csv").touch()
    with pytest.raises(DatasetError, match=r"data must be a \.jsonl, \.json or \.txt file or a folder$"):
        find_files(tmp_path / "scores.csv")


def test_files_are_read_in_order(folder):
    (folder / "d.jsonl").write_text(json.dumps(RATING) + "\n" + json.dumps(RATING))
    recording(folder / "b.json", label_Q2=10)
    seen = []
    found = list(read_files(find_files(folder)["all"], lambda: seen.append(1)))
    assert [(each.scene, each.q1, each.q2) for each in found] == [
        ("a", 0.8, 0.4),
        ("b", None, 0.1),
        ("c", 0.8, 0.4),
        ("08093", 0.58, None),
        ("08093", 0.58, None),
    ]
    assert len(seen) == 4


def test_all_broken_files_are_named(folder):
    recording(folder / "a.json", label_Q1=101)
    recording(folder / "c.json", other=1)
    reading = read_files(find_files(folder)["all"])
    assert next(reading).scene == "b"
    with pytest.raises(ScenarioError) as caught:
        next(reading)
    assert str(caught.value).splitlines() == [
        f"{folder / 'a.json'}: snapshot 1: label_Q1 must lie within 0..100, got 101",
        f"{folder / 'c.json'}: no snapshot has a label_Q1 or label_Q2; the last one needs one",
    ]


def test_a_complaint_has_an_end(tmp_path):
    for number in range(23):
        (tmp_path / f"{number:02}.json").write_text("[]")
    with pytest.raises(ScenarioError) as caught:
        list(read_files(find_files(tmp_path)["all"]))
    lines = str(caught.value).splitlines()
    assert (len(lines), lines[-1]) == (21, "and 3 more files")


def test_the_manifest_of_simulated_recordings_is_no_recording(folder):
    (folder / "manifest.json").write_text("{}")
    assert names(find_files(folder)["all"]) == ["a.json", "b.json", "c.json"]


def test_many_files_are_read_by_many_processes(folder, monkeypatch):
    recording(folder / "d.json", label_Q1=-1)
    (folder / "e.jsonl").write_text(json.dumps(RATING))
    files = find_files(folder)["all"]

    def read():
        seen, found = [], []
        with pytest.raises(ScenarioError) as caught:
            for each in read_files(files, lambda: seen.append(1)):
                found.append((each.scene, each.q1, each.q2, len(each.sequence), len(seen)))
        return found, len(seen), str(caught.value)

    alone = read()
    monkeypatch.setattr("reward_model.data.files._MANY", 2)
    monkeypatch.setattr("reward_model.data.files._TOGETHER", 2)
    assert read() == alone
    assert [scene for scene, *_ in alone[0]] == ["a", "b", "c", "08093"]
