"""The commands `heatmap` and `behaviours`."""

import json
import re

import numpy as np
import pytest
from PIL import Image

import reward_model.scorer
from reward_model.analysis.synthetic_scenes import Person, SyntheticScene
from reward_model.commands.main import main
from reward_model.scenes.socnav2_json import write_socnav2


class Indifferent:
    name = "indifferent"

    def score_windows(self, windows):
        return np.full((len(windows), 2), 0.5, dtype=np.float32)


@pytest.fixture
def scene(tmp_path, monkeypatch):
    monkeypatch.setattr(reward_model.scorer, "load_scorer", lambda weights: Indifferent())
    path = tmp_path / "scene.json"
    write_socnav2(SyntheticScene((2.0, 1.0), people=[Person(1.0, -1.0)]).sequence(), path)
    return path


@pytest.mark.parametrize(
    ("options", "size"),
    [
        ([], (700, 300)),
        (["--question", "q2"], (400, 300)),
        (["--question", "q1", "--actions"], (1300, 600)),
    ],
)
def test_a_heatmap_is_drawn(scene, tmp_path, capsys, options, size):
    output = tmp_path / "out.png"
    assert main(["heatmap", str(scene), "-o", str(output), "--resolution", "5", *options]) == 0
    captured = capsys.readouterr()
    assert captured.out == f"{output}\n"
    assert re.fullmatch(rf"{25 * (7 if '--actions' in options else 1)} positions scored in \d+\.\d s\n", captured.err)
    with Image.open(output) as image:
        assert image.size == size


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["-o", "out.jpg"], "output must end in .png, got 'out.jpg'"),
        (["-o", "out.png", "--resolution", "0"], "resolution must be at least 1, got 0"),
    ],
)
def test_bad_options_are_one_line(scene, capsys, arguments, complaint):
    assert main(["heatmap", str(scene), *arguments]) == 2
    assert capsys.readouterr().err == f"reward_model: {complaint}\n"


def test_a_scene_without_a_room_is_one_line_naming_the_file(scene, tmp_path, capsys):
    document = json.loads(scene.read_text())
    for snapshot in document:
        snapshot["walls"] = snapshot["walls"][:2]
    scene.write_text(json.dumps(document))
    assert main(["heatmap", str(scene), "-o", str(tmp_path / "out.png")]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"reward_model: {scene}: ")
    assert error.endswith("a heatmap needs walls around a room, at least 3, got 2\n")
    assert not (tmp_path / "out.png").exists()


def test_behaviours_as_json_markdown_and_table(scene, capsys):
    assert main(["behaviours", "--output-format", "json"]) == 0
    findings = json.loads(capsys.readouterr().out)
    assert [finding["statement"] for finding in findings if finding["holds"]] == ["d2"]
    assert findings[0]["values"] == {"2 people": 0.0, "4 people": 0.0, "8 people": 0.0, "12 people": 0.0}
    assert main(["behaviours", "--output-format", "markdown"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[:2] == ["|  | measured | claim | found | verdict |", "| --- | --- | --- | --- | --- |"]
    assert len(lines) == 2 + len(findings)
    assert main(["behaviours"]) == 0
    printed = capsys.readouterr().out
    assert "[m2]" in printed
    assert "FAIL" in printed


def test_behaviours_of_unknown_weights_are_one_line(capsys):
    assert main(["behaviours", "--weights", "nonsense"]) == 2
    assert "got 'nonsense'" in capsys.readouterr().err
