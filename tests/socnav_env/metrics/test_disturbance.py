import numpy as np
import pytest

from socnav_env.metrics import episode_metrics, person_delay, person_detour
from socnav_env.trajectories.trajectory import Trajectory
from tests.socnav_env.episodes import make_trajectory
from tests.socnav_env.puppets import make_layout


def walk(places: list[list[float]], targets: list[list[float]], walks: bool = True) -> Trajectory:
    """One person, one place a step of 1 s; targets[k] is where step k + 1 was meant to lead."""
    people = np.array(places)[:, None]
    layout = make_layout(
        people_poses=np.array([[*places[0], 0.0]]),
        people_walk=np.array([walks]),
        people_group=np.array([-1]),
        interaction_pairs=np.zeros((0, 2), dtype=np.int64),
        interaction_relations=(),
    )
    rows = len(places)
    return make_trajectory(
        np.zeros((rows, 2)),
        people=people,
        layout=layout,
        times=np.arange(rows, dtype=float),
        people_targets=np.array([targets[0], *targets])[:, None],
    )


A, B, C = [4.0, 0.0], [4.0, 3.0], [0.0, 9.0]
STRAIGHT = walk([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [4.0, 0.0]], [A] * 4)


def test_someone_who_waits_is_late_but_makes_no_detour() -> None:
    waiting = walk([[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [1.0, 0.0], [2.0, 0.0]], [A] * 4)
    assert person_delay(waiting, STRAIGHT) == pytest.approx(2.0)
    assert person_detour(waiting, STRAIGHT) == pytest.approx(0.0)


def test_someone_who_steps_aside_makes_a_detour() -> None:
    # 1 m aside and back on the way: at (3, 0) after 5 m instead of 3 m, 2 s late.
    aside = walk([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [2.0, 1.0], [2.0, 0.0], [3.0, 0.0]], [A] * 5)
    assert person_detour(aside, STRAIGHT) == pytest.approx(2.0)
    assert person_delay(aside, STRAIGHT) == pytest.approx(2.0)


def test_progress_between_two_rows_is_interpolated() -> None:
    slow = walk([[0.0, 0.0], [0.75, 0.0], [1.5, 0.0]], [A] * 2)
    assert person_delay(slow, STRAIGHT) == pytest.approx(0.5)


def test_walks_count_while_their_targets_are_the_same() -> None:
    without = walk([[2.0, 0.0], [3.0, 0.0], [4.0, 0.0], [4.0, 1.0], [4.0, 2.0], [4.0, 1.0]], [A, A, B, B, C])
    robot = walk(
        [[2.0, 0.0], [3.0, 0.0], [3.0, 0.0], [4.0, 0.0], [4.0, 0.0], [4.0, 1.0], [5.0, 1.0]], [A, A, A, B, B, [9, 9]]
    )
    # One second late at the first target and one more at (4, 1); then the person walks elsewhere.
    assert person_delay(robot, without) == pytest.approx(2.0)
    assert person_detour(robot, without) == pytest.approx(0.0)


def test_an_episode_is_no_disturbance_to_itself() -> None:
    assert person_delay(STRAIGHT, STRAIGHT) == person_detour(STRAIGHT, STRAIGHT) == 0.0


def test_nothing_to_compare_is_not_a_number() -> None:
    standing = walk([[0.0, 0.0]] * 3, [A] * 2, walks=False)
    elsewhere = walk([[0.0, 0.0], [0.0, 1.0]], [C])
    for one, other in ((STRAIGHT, None), (standing, standing), (STRAIGHT, elsewhere)):
        assert np.isnan(person_delay(one, other))
        assert np.isnan(person_detour(one, other))


def test_all_measures_take_the_episode_without_the_robot() -> None:
    waiting = walk([[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [1.0, 0.0], [2.0, 0.0]], [A] * 4)
    assert episode_metrics(waiting, STRAIGHT)["person_delay"] == pytest.approx(2.0)
    assert np.isnan(episode_metrics(waiting)["person_delay"])
