"""Films of episodes: smooth, with heatmaps, and Gymnasium's own."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import imageio.v3 as imageio
import numpy as np
import pytest

from socnav_env.commands.main import main
from socnav_env.config import EnvConfig
from socnav_env.env import SocNavEnv
from socnav_env.recording.files import Recording, record_episode, write_recording
from socnav_env.recording.films import Look, draw_recording, encode_film
from socnav_env.rendering.playback import view_at

QUICK = EnvConfig(time_limit=1.0)


@pytest.fixture(scope="module")
def recording() -> Recording:
    env = SocNavEnv("sparse", config=QUICK)
    env.reset(seed=2)
    while not any(env.step(np.array([1.0, 1.0]))[2:4]):
        pass
    return record_episode(env)


def test_between_two_steps_poses_change_evenly(recording: Recording) -> None:
    trajectory = recording.trajectory
    view = view_at(trajectory, 0.45, QUICK)
    robot, people = trajectory.robot_poses, trajectory.people_poses
    np.testing.assert_allclose(view.robot_pose, 0.75 * robot[2] + 0.25 * robot[3])
    np.testing.assert_allclose(view.people_poses[:, :2], (0.75 * people[2] + 0.25 * people[3])[:, :2])
    assert (view.time, view.outcome) == (pytest.approx(0.45), None)
    np.testing.assert_array_equal(view.trail[-1], view.robot_pose[:2])


def test_at_steps_and_beyond_it_is_what_was_recorded(recording: Recording) -> None:
    for time, row in ((0.0, 0), (0.6, 3), (9.0, 5)):
        np.testing.assert_array_equal(
            view_at(recording.trajectory, time, QUICK).robot_pose, recording.trajectory.robot_poses[row]
        )
    assert view_at(recording.trajectory, 1.0, QUICK).outcome == "timeout"


def test_who_turns_past_the_back_turns_the_short_way(recording: Recording) -> None:
    trajectory = recording.trajectory
    poses = trajectory.robot_poses.copy()
    poses[:2, 2] = 3.1, -3.1
    changed = replace(trajectory, robot_poses=poses)
    assert view_at(changed, 0.1, QUICK).robot_pose[2] == pytest.approx(np.pi)


def test_a_film_has_sixty_pictures_a_second(recording: Recording, tmp_path: Path) -> None:
    file, film = tmp_path / "episode.npz", tmp_path / "film.mp4"
    write_recording(recording, file)
    assert main(["render", str(file), "-o", str(film)]) == 0
    import imageio_ffmpeg

    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(film))
    assert frames == 61
    assert seconds == pytest.approx(61 / 60, abs=0.02)
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["episode.npz", "film.mp4"]


def test_pictures_can_come_at_any_rate(recording: Recording) -> None:
    assert len(list(draw_recording(recording, True, Look()))) == 6
    assert len(list(draw_recording(recording, True, Look(fps=20)))) == 21
    assert len(list(draw_recording(recording, False, Look(fps=20)))) == 1


def test_a_heatmap_lies_under_the_scene(recording: Recording, feature_scorer) -> None:
    plain, ringed, heated = (
        next(iter(draw_recording(recording, False, look)))
        for look in (Look(), Look(rings=True), Look(scorer=feature_scorer))
    )
    assert 0 < (plain != ringed).any(axis=2).mean() < 0.1
    assert (plain != heated).any(axis=2).mean() > 0.4
    np.testing.assert_array_equal(plain[-50:], heated[-50:])


@pytest.mark.parametrize("fps", ["0", "-3", "999"])
def test_a_rate_that_cannot_be_is_refused(fps: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["render", "film.mp4", "--fps", fps]) == 2
    assert "fps must be above 0 and at most 240, got" in capsys.readouterr().err


def test_without_an_encoder_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(ValueError, match=r'an \.mp4 needs an encoder: pip install "socnav2\[video\]"'):
        encode_film([np.zeros((4, 4, 3), dtype=np.uint8)], 5)


@pytest.mark.filterwarnings("ignore:invalid escape sequence:DeprecationWarning")  # moviepy's own
def test_gymnasium_records_videos_without_a_display(tmp_path: Path) -> None:
    env = gym.make("SocNav2-v0", reward="sparse", config=QUICK, render_mode="rgb_array", scenario=None)
    env = gym.wrappers.RecordVideo(env, str(tmp_path / "videos"), disable_logger=True)
    env.reset(seed=0)
    while not any(env.step(np.zeros(2, dtype=np.float32))[2:4]):
        pass
    env.close()
    (video,) = tmp_path.glob("videos/*.mp4")
    assert imageio.immeta(video, plugin="FFMPEG")["fps"] == 5
