import json
import subprocess
import sys

import pytest

from reward_model.commands.main import main
from tests.reward_model.example_scenes import hand_made_document


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(hand_made_document()))
    return path


def test_score_prints_one_json_line_a_file(shared_data, published_weights, capsys):
    folder = shared_data / "socnav2_samples"
    expected = json.loads((folder / "reference.json").read_text())
    files = [str(folder / f"{name}.json") for name in ("S3I_000000", "S1_000000")]
    assert main(["score", *files, "--weights", "published"]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [line["file"] for line in lines] == files
    for line, name in zip(lines, ("S3I_000000", "S1_000000"), strict=True):
        assert list(line) == ["file", "q1", "q2", "q1_std", "q2_std", "in_range", "out_of_range"]
        assert (line["q1_std"], line["in_range"], line["out_of_range"]) == (0.0, True, [])
        assert line["q1"] == pytest.approx(expected[name]["q1"], abs=1e-4)
        assert line["q2"] == pytest.approx(expected[name]["q2"], abs=1e-4)


def test_bad_files_are_named_a_line_each_and_nothing_is_printed(scene, published_weights, tmp_path, capsys):
    bad = tmp_path / "bad.json"
    bad.write_text("[]")
    files = [str(scene), str(bad), str(tmp_path / "absent.json")]
    assert main(["score", *files, "--weights", "published"]) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.splitlines() == [
        f"reward_model: {bad}: must be a list of at least one snapshot, got an empty one",
        f"reward_model: {tmp_path / 'absent.json'}: cannot read it: No such file or directory",
    ]


def test_a_scene_whose_walls_change_is_refused_by_its_file_name(scene, published_weights, capsys):
    document = hand_made_document()
    document[0]["timestamp"] = 9.0
    document[0]["walls"].pop()
    scene.write_text(json.dumps(document))
    assert main(["score", str(scene), "--weights", "published"]) == 2
    assert capsys.readouterr().err.startswith(f"reward_model: {scene}: ")


def test_a_score_that_is_no_number_is_refused(scene, published_weights, capsys):
    document = hand_made_document()
    document[1]["people"][0]["x"] = 1e60
    scene.write_text(json.dumps(document))
    assert main(["score", str(scene), "--weights", "published"]) == 2
    output = capsys.readouterr()
    assert (output.out, output.err.startswith(f"reward_model: {scene}: ")) == ("", True)


def test_score_without_files_is_refused(capsys):
    assert main(["score"]) == 2
    assert capsys.readouterr().err == "reward_model: score needs at least one file\n"


def test_missing_published_weights_say_how_to_get_them(scene, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("SOCNAV_CACHE", str(tmp_path / "empty"))
    assert main(["score", str(scene), "--weights", "published"]) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert "`python -m reward_model import-published socnavgym==0.1.1`" in output.err
    assert output.err.count("\n") == 1


def test_unknown_weights_are_refused(scene, capsys):
    assert main(["score", str(scene), "--weights", "nonsense"]) == 2
    assert "got 'nonsense'" in capsys.readouterr().err


def test_a_bad_source_is_refused(capsys):
    assert main(["import-published", "nonsense"]) == 2
    assert "source must be an existing wheel or folder" in capsys.readouterr().err


def test_an_unknown_option_exits_with_2(capsys):
    with pytest.raises(SystemExit) as caught:
        main(["score", "x.json", "--form", "nonsense"])
    assert caught.value.code == 2


def test_help_needs_neither_torch_nor_dgl_nor_numba():
    code = (
        "import sys\nfrom reward_model.commands.main import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit as end:\n    assert end.code == 0\n"
        "assert not {'torch', 'dgl', 'numba'} & sys.modules.keys()\n"
    )
    outcome = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert outcome.returncode == 0, outcome.stderr
    assert "import-published" in outcome.stdout


def test_a_reader_that_leaves_early_is_no_error(scene, published_weights):
    command = [sys.executable, "-m", "reward_model", "score", "--weights", "published", *[str(scene)] * 3]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 0
