import numpy as np
import pytest

from reward_model.scenes.scene import Scores
from socnav_env import episode as episode_module
from socnav_env.config import EnvConfig, RewardConfig
from socnav_env.config.checks import ConfigError
from socnav_env.episode import MAX_STARTS, Episode, begin_episode
from socnav_env.trajectories.outcomes import Outcome
from tests.socnav_env.puppets import PuppetWorld

DRIVE = np.array([0.3, 0.0, 0.0])


def started(judged: bool = False, observed: bool = False, **changes) -> Episode:
    return Episode(PuppetWorld(), EnvConfig(**changes), judged, observed=observed)


def test_an_episode_starts_after_its_warm_up() -> None:
    episode = started()
    assert episode.world.time == pytest.approx(2.0)
    np.testing.assert_array_equal(episode.world.robot_pose, np.zeros(3))
    assert (episode.steps, episode.time_left, episode.outcome) == (0, 1.0, None)


def test_only_a_judged_episode_keeps_frames() -> None:
    assert started().window() == []
    assert len(started(judged=True).window()) == 3


def test_an_observation_sees_real_time_and_a_scorer_slowed_time() -> None:
    reward = RewardConfig(time_scale=2.5)
    episode = started(judged=True, observed=True, reward=reward)
    for _ in range(5):
        episode.advance(DRIVE)
        episode.conclude(Scores(0.9, 0.8))
    real, judged = episode.observed_window(), episode.window()
    advance = [frame.arrays.features[0, 17] for frame in real]
    assert advance == pytest.approx([0.3 * 9.4 / 3.5, 0.0, 0.0])  # 1 s ago the robot stood
    assert [frame.arrays.features[0, 17] for frame in judged] == pytest.approx([0.12 * 9.4 / 3.5] * 3)
    assert episode.recent_sequence().last.timestamp == pytest.approx(7.5)  # type: ignore[union-attr]
    assert len(episode._recorders) == 2
    assert len(started(judged=True, observed=False, reward=reward)._recorders) == 1
    assert len(started(judged=False, observed=True, reward=reward)._recorders) == 1
    assert len(started(judged=True, observed=True)._recorders) == 1


def test_a_moment_says_how_far_the_robot_has_come() -> None:
    episode = started()
    episode.advance(DRIVE)
    moment = episode.conclude(Scores(0.9, 0.8))
    assert moment.progress == pytest.approx(0.06)
    assert (moment.duration, moment.outcome, moment.scores) == (0.2, None, Scores(0.9, 0.8))
    episode.advance(-DRIVE)
    assert episode.conclude(None).progress == pytest.approx(-0.06)
    assert len(episode.trajectory()) == episode.steps == 2


def test_the_last_step_is_the_one_that_uses_up_the_time() -> None:
    episode = started(time_limit=0.6)
    outcomes = []
    for _ in range(3):
        episode.advance(DRIVE)
        outcomes.append(episode.outcome)
        episode.conclude(None)
    assert outcomes == [None, None, Outcome.TIMEOUT]
    assert episode.time_left == 0.0


def test_a_view_shows_the_window_behind_the_robot() -> None:
    episode = started()
    for _ in range(15):
        episode.advance(DRIVE)
        episode.conclude(Scores(0.9, 0.8))
    view = episode.view()
    np.testing.assert_allclose(view.trail[:, 0], 0.06 * np.arange(5, 16))
    np.testing.assert_allclose(view.trail_marks[:, 0], [0.06 * 10, 0.06 * 5])
    np.testing.assert_allclose(view.robot_pose, [0.9, 0.0, 0.0])
    assert (view.time, view.scores, view.outcome) == (pytest.approx(3.0), Scores(0.9, 0.8), None)


def test_a_view_of_a_slowed_episode_marks_the_scored_frames() -> None:
    episode = started(reward=RewardConfig(time_scale=2.5))
    for _ in range(15):
        episode.advance(DRIVE)
        episode.conclude(Scores(0.9, 0.8))
    view = episode.view()
    np.testing.assert_allclose(view.trail[:, 0], 0.06 * np.arange(5, 16))
    np.testing.assert_allclose(view.trail_marks[:, 0], [0.06 * 13, 0.06 * 11])


def test_a_view_of_the_start_has_nothing_behind_it() -> None:
    view = started().view()
    assert view.trail.shape == (1, 2)
    assert view.trail_marks.shape == (0, 3)


def test_scenes_that_are_over_before_they_begin_are_drawn_anew_but_not_forever(monkeypatch) -> None:
    drawn = []

    def touched_world(layout, config, random) -> PuppetWorld:
        world = PuppetWorld()
        world.contacts.person = len(drawn) < 3
        drawn.append(world)
        return world

    monkeypatch.setattr(episode_module, "World", touched_world)
    assert begin_episode(EnvConfig(), np.random.default_rng(0), judged=False).world is drawn[3]
    monkeypatch.setattr(episode_module, "decide_outcome", lambda world, steps_left: Outcome.COLLISION_PERSON)
    with pytest.raises(ConfigError, match=rf"people touched it in {MAX_STARTS} scenes in a row"):
        begin_episode(EnvConfig(), np.random.default_rng(0), judged=False)
