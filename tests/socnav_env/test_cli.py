import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from socnav_env.cli import encode_pictures, main

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
        (["end.jpg"], "output must end in .gif or .png, got 'end.jpg'"),
        (["end.png", "--driver", "nobody"], "driver must be one of goal, polite, chaser"),
        (["end.png", "--reward", "nothing"], "reward must be one of learned, q2, crowdnav, sparse"),
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
        "import sys, socnav_env.cli; "
        "sys.exit(any(name in sys.modules for name in ('torch', 'numba', 'pygame', 'pymunk')))"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
