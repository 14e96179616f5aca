import pytest

from reward_model.base.progress import progress_bars, watched


def test_nobody_watches(capfd: pytest.CaptureFixture[str]) -> None:
    with progress_bars(kept=True) as progress:
        progress.advance(progress.add_task("adding up", total=1))
    assert list(watched(range(3), "counting")) == [0, 1, 2]
    assert capfd.readouterr() == ("", "")


def test_somebody_watches(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # what rich takes for a terminal
    with progress_bars(kept=True) as progress:
        progress.advance(progress.add_task("adding up", total=1))
    assert list(watched(range(3), "counting")) == [0, 1, 2]
    assert list(watched(range(3), "being quick", least=4)) == [0, 1, 2]
    with progress_bars(shown=False) as progress:
        progress.advance(progress.add_task("in the background", total=1))
    printed = capfd.readouterr()
    assert "adding up" in printed.err
    assert "counting" in printed.err
    assert "being quick" not in printed.err
    assert "in the background" not in printed.err
    assert not printed.out
