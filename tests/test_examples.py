"""The short examples run and say something."""

import runpy
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "examples"
SHORT = ("custom_observation", "custom_reward", "dqn")


@pytest.mark.parametrize("name", SHORT)
def test_it_runs(name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(FOLDER / f"{name}.py")
    monkeypatch.setattr("sys.argv", [path])
    runpy.run_path(path, run_name="__main__")
    assert capsys.readouterr().out.strip()
