import subprocess
import sys

import numpy as np
import pytest

from benchmarks.realism.crowd_replay import (
    KINDS,
    STEPS,
    Figures,
    figures_of,
    real_walker,
    social_force_walker,
    straight_walker,
)
from benchmarks.realism.simulated_crowd import real_crowd, simulated_crowd
from benchmarks.realism.tracks import HORIZON, Track, TracksError, read_groups, read_tracks, walks_of
from benchmarks.realism.walking import walking_of
from socnav_env.config import EnvConfig, PeopleConfig


def straight_track(start, velocity, rows, first=0):
    """A person who walks straight ahead."""
    return Track(first, np.array(start) + 0.4 * np.arange(rows)[:, None] * np.array(velocity))


def test_tracks_are_read_by_id(tmp_path):
    file = tmp_path / "street.txt"
    file.write_text("11 3 1.5 0 2.5 0 0 0\n21 3 1.6 0 2.5 0 0 0\n21 4 7 0 8 0 0 0\n")
    tracks = read_tracks(file)
    assert {identity: (track.first, track.places.tolist()) for identity, track in tracks.items()} == {
        3: (0, [[1.5, 2.5], [1.6, 2.5]]),
        4: (1, [[7.0, 8.0]]),
    }
    (tmp_path / "groups.txt").write_text("3 4\n")
    assert len(set(read_groups(tmp_path / "groups.txt", tracks).tolist())) == 1


@pytest.mark.parametrize(
    ("text", "message"),
    [("1 1 0 0 0\n", "must have eight finite numbers"), ("1 1 0 0 0 0 0 0\n21 1 0 0 0 0 0 0\n", "without gaps")],
)
def test_files_that_are_no_tracks_are_named(tmp_path, text, message):
    file = tmp_path / "street.txt"
    file.write_text(text)
    with pytest.raises(TracksError, match=message):
        read_tracks(file)


def test_every_4_8_s_of_a_track_is_a_walk_among_those_who_are_there():
    tracks = {
        1: straight_track((0.0, 0.0), (1.0, 0.0), 2 * HORIZON + 2),
        2: straight_track((0.0, 1.0), (1.0, 0.0), 3, first=10),
        3: straight_track((0.0, 5.0), (1.0, 0.0), 3, first=90),
    }
    walks = walks_of(tracks)
    assert walks.paths[:, 0] == pytest.approx(np.array([[0.4, 0.0], [5.2, 0.0]]))
    assert walks.velocities == pytest.approx(np.array([[1.0, 0.0], [1.0, 0.0]]))
    assert walks.exits == pytest.approx(np.array([[10.0, 0.0], [10.0, 0.0]]))
    assert walks.others.shape == (2, 1, HORIZON + 1, 2)
    assert walks.others[0, 0, 9:12, 0] == pytest.approx([0.0, 0.4, 0.8])
    assert np.isnan(walks.others[0, 0, :9]).all()
    assert np.isnan(walks.others[1]).all()


def test_on_a_straight_track_every_walker_is_right():
    walks = walks_of({1: straight_track((0.0, 0.0), (1.2, 0.5), HORIZON + 2)})
    for kind in KINDS:
        assert figures_of(walks, straight_walker(walks, kind)) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert figures_of(walks, real_walker(walks)) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    walker = social_force_walker(PeopleConfig.pedestrians())
    assert walker(walks, "exit").shape == (1, STEPS + 1, 2)
    assert figures_of(walks, walker(walks, "exit")).ade < 0.1


def test_errors_and_collisions_have_their_definition():
    track = straight_track((0.0, 0.0), (1.0, 0.0), HORIZON + 2)
    beside = Track(0, track.places + np.array([0.0, 0.6]))
    walks = walks_of({1: track})
    shifted = real_walker(walks) + np.array([0.0, 0.3])
    assert figures_of(walks, shifted) == pytest.approx((0.3, 0.3, 0.0))
    among = walks_of({1: track, 2: beside})
    assert figures_of(among, real_walker(among)) == Figures(0.0, 0.0, 0.0)
    shifted = real_walker(among) + np.array([[[0.0, 0.3]], [[0.0, 0.0]]])
    assert figures_of(among, shifted).collisions == 0.5


def test_a_walker_keeps_off_whom_the_straight_one_runs_into():
    walker = straight_track((0.0, 0.0), (1.0, 0.0), HORIZON + 2)
    stands = straight_track((3.0, 0.3), (0.0, 0.0), HORIZON + 2)
    walks = walks_of({1: walker, 2: stands})
    assert figures_of(walks, straight_walker(walks, "place")).collisions == 1.0
    # One of the two walks is that of who stands there, and is run into by the real walker all the same.
    for people in (PeopleConfig(), PeopleConfig.pedestrians()):
        assert figures_of(walks, social_force_walker(people)(walks, "place")).collisions == 0.5


def test_a_crowd_of_two_who_walk_apart_is_simulated_as_it_was():
    tracks = [straight_track((0.0, 0.0), (1.2, 0.0), 20), straight_track((0.0, 8.0), (1.2, 0.0), 20)]
    real = real_crowd(tracks)
    assert real.speeds == pytest.approx(np.full(38, 1.2))
    assert real.neighbours == pytest.approx(np.full(40, 8.0))
    simulated = simulated_crowd(tracks, np.array([0, 1]), PeopleConfig.pedestrians())
    assert simulated.speeds == pytest.approx(np.full(len(simulated.speeds), 1.2), abs=0.02)
    assert simulated.neighbours == pytest.approx(np.full(len(simulated.neighbours), 8.0), abs=0.02)
    assert 34 <= len(simulated.speeds) <= 38


def test_walking_is_measured_over_half_a_second():
    times = 0.1 * np.arange(21)
    poses = np.zeros((21, 2, 3))
    poses[:, 0, 0], poses[:, 0, 2] = 0.5 * times**2, -0.2 * times
    walking = walking_of(poses, times)  # the second one stands
    assert walking.speeds == pytest.approx([0.25, 0.75, 1.25])
    assert walking.accelerations == pytest.approx([1.0, 1.0])
    assert walking.turn_rates == pytest.approx([0.2, 0.2, 0.2])


def test_the_preset_makes_an_environment():
    assert EnvConfig(people=PeopleConfig.pedestrians()).people.speed == 1.4


def test_a_missing_folder_is_one_line_and_exit_code_2(tmp_path):
    command = [sys.executable, "-m", "benchmarks.realism", "--data", str(tmp_path)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 2
    assert result.stderr.count("\n") == 1
    assert "hotel.txt: must be a file of tracks" in result.stderr


@pytest.mark.slow
def test_on_zara01_the_preset_errs_and_collides_less_than_the_straight_walker(shared_data):
    walks = walks_of(read_tracks(shared_data / "eth_ucy" / "zara01.txt"))
    walker = social_force_walker(PeopleConfig.pedestrians())
    for kind in KINDS:
        straight, simulated = figures_of(walks, straight_walker(walks, kind)), figures_of(walks, walker(walks, kind))
        assert simulated.ade <= straight.ade
        assert simulated.collisions < straight.collisions
