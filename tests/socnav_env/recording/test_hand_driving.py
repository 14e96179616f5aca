"""Driving by hand, with keys that nobody presses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pygame
import pytest

from socnav_env.commands.main import main
from socnav_env.config import EnvConfig, RobotConfig
from socnav_env.env import SocNavEnv
from socnav_env.recording.files import read_recording
from socnav_env.recording.hand_driving import play_by_hand
from socnav_env.rendering import Controls, Renderer
from socnav_env.trajectories.outcomes import Outcome

QUICK = EnvConfig(time_limit=0.6)


@pytest.fixture(autouse=True)
def window(monkeypatch: pytest.MonkeyPatch):
    """A display that nobody sees, and no waiting for frames to be due."""
    pygame.display.init()
    pygame.display.set_mode((10, 10))
    pygame.event.clear()
    monkeypatch.setattr(pygame.time, "Clock", lambda: type("Clock", (), {"tick": lambda self, rate: 0})())
    yield
    pygame.display.quit()


def press(*keys: int, kind: int = pygame.KEYDOWN) -> None:
    for key in keys:
        pygame.event.post(pygame.event.Event(kind, key=key))


def listened(*, axes: dict[int, float] | None = None) -> Controls:
    controls = Controls()
    for axis, value in (axes or {}).items():
        pygame.event.post(pygame.event.Event(pygame.JOYAXISMOTION, axis=axis, value=value, instance_id=0))
    controls.listen()
    return controls


def test_keys_drive_for_as_long_as_they_are_held() -> None:
    press(pygame.K_UP, pygame.K_LEFT)
    controls = listened()
    assert controls.drive == (1.0, 0.0, 1.0)
    press(pygame.K_LEFT, kind=pygame.KEYUP)
    press(pygame.K_d)
    controls.listen()
    assert controls.drive == (1.0, -1.0, 0.0)
    press(pygame.K_DOWN)
    controls.listen()
    assert controls.drive == (0.0, -1.0, 0.0)


def test_a_joystick_drives_and_rests_in_the_middle() -> None:
    assert listened(axes={1: -0.5, 0: 0.25}).drive == (0.5, 0.0, -0.25)
    assert listened(axes={1: 0.05, 0: -0.05}).drive == (0.0, 0.0, 0.0)


def test_toggles_and_requests() -> None:
    press(pygame.K_h, pygame.K_p, pygame.K_SPACE)
    controls = listened()
    assert (controls.heatmap, controls.rings, controls.again, controls.quit) == (True, True, True, False)
    press(pygame.K_h, pygame.K_ESCAPE)
    controls.listen()
    assert (controls.heatmap, controls.quit) == (False, True)
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    assert listened().quit


def test_an_episode_is_driven_recorded_and_followed_by_the_next(tmp_path: Path) -> None:
    env = SocNavEnv("sparse", config=QUICK, render_mode="human", scenario="frontal_approach")
    env.config = QUICK  # the scenario's own time limit is a minute
    press(pygame.K_UP)
    played = play_by_hand(env, 4, tmp_path / "drive.npz")
    assert next(played) is Outcome.TIMEOUT
    press(pygame.K_SPACE)
    assert next(played) is Outcome.TIMEOUT
    press(pygame.K_ESCAPE)
    assert list(played) == []
    recording = read_recording(tmp_path / "drive.npz")
    np.testing.assert_allclose(recording.trajectory.commands[:, 0], RobotConfig.max_forward_speed)
    assert recording.trajectory.layout.script is not None
    assert sorted(path.name for path in tmp_path.iterdir()) == ["drive-2.npz", "drive.npz"]
    assert not pygame.display.get_init()


def test_closing_the_window_breaks_an_episode_off(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    assert main(["play", "--reward", "sparse", "--scenario", "blind_corner"]) == 0
    assert capsys.readouterr().out == "seed 0: broken off\n"
    assert main(["play", "--record", "drive.txt"]) == 2
    assert capsys.readouterr().err == "socnav_env: record must end in .npz, got 'drive.txt'\n"


def test_the_window_shows_the_heatmap_where_it_is_asked_for(feature_reward, monkeypatch: pytest.MonkeyPatch) -> None:
    shown = []
    monkeypatch.setattr(Renderer, "_picture", lambda self, view: shown.append(view) or pygame.Surface((10, 10)))
    env = SocNavEnv(feature_reward, config=EnvConfig(time_limit=2.0), render_mode="human")
    env.reset(seed=0)
    env.step(np.zeros(2))
    assert len(shown) == 1 + 12  # sixty a second
    assert shown[-1].heat is None
    press(pygame.K_h, pygame.K_p)
    env.render()
    env.step(np.zeros(2))
    assert shown[-1].heat is not None
    assert shown[-1].rings
    env.close()
