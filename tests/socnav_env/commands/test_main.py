import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from reward_model.scenes.socnav2_json import read_socnav2
from socnav_env.commands.main import main
from socnav_env.commands.pictures import read_env_config
from socnav_env.config import EnvConfig
from socnav_env.env import SocNavEnv
from socnav_env.metrics import METRICS
from socnav_env.recording.files import RecordTrajectory, read_recording, write_recording
from socnav_env.recording.films import encode_pictures
from tests.socnav_env.recording.test_files import play

QUICK = '{"time_limit": 1.0}'


@pytest.fixture
def quick(tmp_path: Path) -> str:
    path = tmp_path / "env.json"
    path.write_text(QUICK)
    return str(path)


def test_a_gif_shows_the_whole_episode(tmp_path: Path, quick: str, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "new" / "episode.gif"
    arguments = ["render", str(output), "--driver", "stander", "--reward", "sparse", "--env-config", quick]
    assert main(arguments) == 0
    assert capsys.readouterr().out == f"{output}: timeout\n"
    with Image.open(output) as picture:
        assert picture.size == (600, 600)
        assert picture.n_frames > 1
    assert [path.name for path in output.parent.iterdir()] == ["episode.gif"]


def test_a_png_shows_how_it_ended(tmp_path: Path, quick: str) -> None:
    output = tmp_path / "end.PNG"
    assert main(["render", str(output), "--driver", "joystick", "--reward", "sparse", "--env-config", quick]) == 0
    with Image.open(output) as picture:
        assert (picture.format, picture.size) == ("PNG", (600, 600))


def test_the_same_seed_draws_the_same_picture(tmp_path: Path, quick: str) -> None:
    outputs = [tmp_path / name for name in ("one.png", "other.png")]
    for output in outputs:
        main(["render", str(output), "--seed", "3", "--reward", "sparse", "--env-config", quick])
    assert outputs[0].read_bytes() == outputs[1].read_bytes()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["end.jpg"], "output must end in .gif, .mp4, .png, got 'end.jpg'"),
        (["end.png", "--driver", "nobody"], "driver must be one of goal, polite, chaser"),
        (["end.png", "--reward", "nothing"], "reward must be one of learned, "),
        (["end.png", "--seed", "-1"], "seed must not be negative, got -1"),
        (["end.png", "--env-config", "bad.json"], "bad.json: "),
        (["end.png", "--env-config", "unknown.json"], "unknown.json: unknown key"),
        (["end.png", "--env-config", "missing.json"], "missing.json"),
    ],
)
def test_bad_input_is_answered_with_one_line(
    arguments: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.json").write_text("{")
    (tmp_path / "unknown.json").write_text('{"rooms": {}}')
    reward = [] if "--reward" in arguments else ["--reward", "sparse"]
    assert main(["render", *arguments, *reward]) == 2
    error = capsys.readouterr().err
    assert error.startswith("socnav_env: ")
    assert message in error
    assert error.count("\n") == 1
    assert not list(tmp_path.glob("end.*"))


def test_one_picture_is_a_png_and_several_are_a_gif() -> None:
    picture = Image.fromarray(np.zeros((4, 4, 3), dtype=np.uint8))
    assert encode_pictures([picture], 0.2).startswith(b"\x89PNG")
    assert encode_pictures([picture, picture], 0.2).startswith(b"GIF89a")


def test_help_names_the_commands_and_loads_nothing_heavy() -> None:
    answer = subprocess.run([sys.executable, "-m", "socnav_env", "--help"], capture_output=True, text=True, check=True)
    assert "render" in answer.stdout
    program = (
        "import sys, socnav_env.commands.main; "
        "sys.exit(any(name in sys.modules for name in ('torch', 'numba', 'pygame', 'pymunk')))"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_the_configuration_is_explained_and_its_json_read(tmp_path: Path, capsys) -> None:
    assert main(["config"]) == 0
    assert 'robot.drive = "differential"\n    "differential" (forward and turn)' in capsys.readouterr().out
    assert main(["config", "--json"]) == 0
    (tmp_path / "config.json").write_text(capsys.readouterr().out)
    assert read_env_config(tmp_path / "config.json") == EnvConfig()


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recording of one second in which the robot stands."""
    folder = tmp_path_factory.mktemp("recordings")
    env = RecordTrajectory(SocNavEnv(reward="sparse", config=EnvConfig(time_limit=1.0)), folder)
    play(env, "stander", seed=1)
    return folder / "episode-000000.npz"


@pytest.fixture
def changed(recorded: Path, tmp_path: Path) -> Path:
    """The same recording with a robot that is said to have moved in step 3."""
    recording = read_recording(recorded)
    poses = recording.trajectory.robot_poses.copy()
    poses[3:, 0] += 1e-12
    path = tmp_path / "changed.npz"
    write_recording(replace(recording, trajectory=replace(recording.trajectory, robot_poses=poses)), path)
    return path


@pytest.fixture
def foreign(recorded: Path, tmp_path: Path) -> Path:
    """The same recording, said to be of another version."""
    recording = read_recording(recorded)
    path = tmp_path / "foreign.npz"
    write_recording(replace(recording, versions={**recording.versions, "numpy": "0.1"}), path)
    return path


def test_replaying_says_whether_all_bits_are_the_same(
    recorded: Path, changed: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["replay", str(recorded)]) == 0
    assert capsys.readouterr().out == f"{recorded}: identical, 5 steps\n"
    assert main(["replay", str(changed), str(recorded)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith(f"{changed}: robot_poses differs first at step 3: recorded ")
    assert lines[1] == f"{recorded}: identical, 5 steps"


def test_replaying_refuses_bad_files_and_goes_on(
    recorded: Path, changed: Path, foreign: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cut = tmp_path / "cut.npz"
    cut.write_bytes(recorded.read_bytes()[:500])
    assert main(["replay", str(cut), str(foreign), str(tmp_path / "none.npz"), str(changed), str(recorded)]) == 2
    captured = capsys.readouterr()
    assert len(captured.out.splitlines()) == 2
    lines = captured.err.splitlines()
    assert [line.startswith("socnav_env: ") for line in lines] == [True] * 3
    assert "cut.npz: must be a whole .npz file" in lines[0]
    assert "foreign.npz: must be simulated by the versions that recorded it" in lines[1]
    assert "none.npz: cannot read it" in lines[2]
    assert main(["replay"]) == 2
    assert capsys.readouterr().err == "socnav_env: replay needs at least one file\n"


def test_measures_of_a_recording_are_printed_and_written(
    recorded: Path, foreign: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "measures.json"
    assert main(["metrics", str(recorded), "-o", str(output), "--without-robot"]) == 0
    printed = dict(line.split() for line in capsys.readouterr().out.splitlines())
    assert list(printed) == list(METRICS)
    assert (printed["timeout"], printed["time_not_moving"], printed["path_length"]) == ("1", "1", "nan")
    document = json.loads(output.read_text())
    assert (document["file"], document["scorer"]) == (str(recorded), None)
    assert document["metrics"]["time_not_moving"] == pytest.approx(1.0)
    assert document["metrics"]["path_length"] is None
    assert list(document["metrics"]) == list(METRICS)
    assert main(["metrics", str(foreign)]) == 0  # measuring needs no simulation
    assert main(["metrics", str(foreign), "--without-robot"]) == 2


def test_measures_can_be_scored_anew(
    recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, feature_scorer
) -> None:
    monkeypatch.setattr("socnav_env.recording.measure.load_scorer", lambda weights: feature_scorer)
    assert main(["metrics", str(recorded), "--weights", "any", "-o", str(tmp_path / "m.json")]) == 0
    document = json.loads((tmp_path / "m.json").read_text())
    assert document["scorer"] == "features"
    assert 0 <= document["metrics"]["q1_mean"] <= 1
    assert feature_scorer.lengths == [3] * 5


def test_measures_of_genuine_scenes(
    shared_data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, feature_scorer
) -> None:
    monkeypatch.setattr("socnav_env.recording.measure.load_scorer", lambda weights: feature_scorer)
    for file in sorted((shared_data / "socnav2_samples").glob("S*.json")):
        output = tmp_path / file.name
        assert main(["metrics", str(file), "-o", str(output), "--weights", "any"]) == 0
        metrics = json.loads(output.read_text())["metrics"]
        assert metrics["success"] is None
        assert metrics["min_person_distance"] > 0
        assert 0 <= metrics["q2_mean"] <= 1


def test_sizes_that_a_scene_does_not_say_can_be_given(shared_data: Path, tmp_path: Path) -> None:
    file, output = shared_data / "socnav2_samples" / "S2_000000.json", tmp_path / "m.json"
    distances = []
    for radius in ("0.25", "0.35"):
        assert main(["metrics", str(file), "-o", str(output), "--robot-radius", radius]) == 0
        distances.append(json.loads(output.read_text())["metrics"]["min_person_distance"])
    assert distances[0] - distances[1] == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("content", "options", "message"),
    [
        ("[]", [], "must be a list of at least one snapshot"),
        ("{", [], "must be JSON"),
        ("[]", ["--without-robot"], "without_robot needs a recording"),
        ("[]", ["--robot-radius", "0"], "robot_radius must be a positive number, got 0.0"),
        (None, [], "No such file"),
    ],
)
def test_what_cannot_be_measured_is_refused_with_one_line(
    content: str | None, options: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "scene.json"
    if content is not None:
        file.write_text(content)
    assert main(["metrics", str(file), *options]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_a_scene_without_robot_poses_is_refused(tmp_path: Path, recorded: Path, capsys) -> None:
    scene = tmp_path / "scene.json"
    assert main(["export", str(recorded), "-o", str(scene)]) == 0
    document = json.loads(scene.read_text())
    assert len(document) == 16
    del document[2]["robot_pose"]
    scene.write_text(json.dumps(document))
    capsys.readouterr()
    assert main(["metrics", str(scene)]) == 2
    assert "scene.json: episode-000000: snapshot 2: robot_pose is missing" in capsys.readouterr().err


def test_an_export_is_a_scene_for_the_reward_model(recorded: Path, tmp_path: Path, capsys) -> None:
    scene = tmp_path / "scene.json"
    assert main(["export", str(recorded), "-o", str(scene)]) == 0
    assert capsys.readouterr().out == f"{scene}: 16 snapshots\n"
    assert read_socnav2(scene).name == "episode-000000"


def test_a_recording_is_drawn_like_the_episode_was(recorded: Path, tmp_path: Path) -> None:
    picture, clip = tmp_path / "end.png", tmp_path / "clip.gif"
    assert main(["render", str(recorded), "-o", str(picture)]) == 0
    assert main(["render", str(recorded), "--output", str(clip)]) == 0
    env = SocNavEnv(reward="sparse", config=EnvConfig(time_limit=1.0))
    play(env, "stander", seed=1)
    with Image.open(picture) as drawn:
        np.testing.assert_array_equal(np.asarray(drawn), env.frame())
    with Image.open(clip) as drawn:
        assert drawn.size == (600, 600)


def test_only_a_recording_is_drawn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.json").write_text("[]")
    assert main(["render", str(tmp_path / "scene.json"), "-o", str(tmp_path / "clip.gif")]) == 2
    assert "scene.json: must be a whole .npz file" in capsys.readouterr().err
    assert main(["render", str(tmp_path / "scene.json"), "-o", "clip.avi"]) == 2
    assert "output must end in .gif, .mp4, .png, got 'clip.avi'" in capsys.readouterr().err
