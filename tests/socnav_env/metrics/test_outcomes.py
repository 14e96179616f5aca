import math

import numpy as np
import pytest

from socnav_env.layout import ObjectKind
from socnav_env.metrics import METRICS, path_length, spl, stl, time_to_goal
from socnav_env.trajectories.outcomes import Outcome
from tests.socnav_env.episodes import make_trajectory
from tests.socnav_env.puppets import make_layout

ENDS = ("success", "timeout", "collision_person", "collision_object", "collision_wall")
DETOUR = [[0.0, 0.0], [0.0, 1.5], [2.0, 1.5], [2.0, 0.0]]  # 5 m in 0.6 s, to a goal 2 m away

# A 0.8 m square stands between start and goal, 1 m from both.
BLOCKED = make_layout(
    people_poses=np.zeros((0, 3)),
    object_poses=np.array([[1.0, 0.0, 0.0]]),
    object_sizes=np.array([[0.8, 0.8]]),
    object_kinds=np.array([ObjectKind.TABLE]),
    interaction_pairs=np.zeros((0, 2), dtype=np.int64),
    interaction_relations=(),
)
# Up to the corner 0.4 m to the side and 0.6 m ahead along a tangent, around the corner, 0.8 m along the side, and
# the same way down: the tangent is sqrt(0.6^2 + 0.4^2 - 0.25^2) long, the arc turns by asin(0.25 / corner's distance)
# plus the corner's own bearing.
CORNER = math.hypot(0.6, 0.4)
AROUND = 0.8 + 2 * (math.sqrt(CORNER**2 - 0.25**2) + 0.25 * (math.asin(0.25 / CORNER) + math.atan2(0.4, 0.6)))


@pytest.mark.parametrize("outcome", list(Outcome))
def test_an_episode_has_one_end(outcome: Outcome) -> None:
    trajectory = make_trajectory(DETOUR, outcome=outcome)
    expected = "success" if outcome is Outcome.ARRIVED else outcome.value
    assert {name: METRICS[name](trajectory) for name in ENDS} == {name: float(name == expected) for name in ENDS}


def test_an_end_that_nobody_knows_is_not_a_number() -> None:
    trajectory = make_trajectory(DETOUR, outcome=None)
    assert all(np.isnan(METRICS[name](trajectory)) for name in (*ENDS, "time_to_goal", "path_length", "spl", "stl"))


def test_only_success_has_a_time_and_a_path_to_the_goal() -> None:
    assert time_to_goal(make_trajectory(DETOUR)) == pytest.approx(0.6)
    assert path_length(make_trajectory(DETOUR)) == pytest.approx(5.0)
    assert np.isnan(time_to_goal(make_trajectory(DETOUR, outcome=Outcome.TIMEOUT)))
    assert np.isnan(path_length(make_trajectory(DETOUR, outcome=Outcome.COLLISION_WALL)))


def test_spl_is_the_straight_lines_share_of_the_way_driven() -> None:
    assert spl(make_trajectory(DETOUR)) == pytest.approx(2.0 / 5.0)
    assert spl(make_trajectory([[0.0, 0.0], [1.6, 0.0]])) == 1.0  # arrived before the goal's centre
    assert spl(make_trajectory(DETOUR, outcome=Outcome.TIMEOUT)) == 0.0


def test_spl_does_not_blame_the_robot_for_what_stands_in_its_way() -> None:
    assert spl(make_trajectory(DETOUR, layout=BLOCKED)) == pytest.approx(AROUND / 5.0, abs=1e-9)


def test_spl_takes_people_for_no_part_of_the_map() -> None:
    assert spl(make_trajectory(DETOUR, people=[[1.0, 0.0]])) == pytest.approx(2.0 / 5.0)


def test_stl_is_the_share_of_the_time_that_top_speed_would_have_taken() -> None:
    slow = {"times": np.array([0.0, 2.0, 4.0, 8.0])}
    assert stl(make_trajectory(DETOUR, **slow)) == pytest.approx((2.0 / 0.5) / 8.0)
    assert stl(make_trajectory(DETOUR, layout=BLOCKED, **slow)) == pytest.approx((AROUND / 0.5) / 8.0)
    assert stl(make_trajectory(DETOUR)) == 1.0
    assert stl(make_trajectory(DETOUR, outcome=Outcome.COLLISION_PERSON)) == 0.0


def test_no_way_at_all_is_not_a_number() -> None:
    outside = make_layout(goal=np.array([5.0, 0.0]))
    assert np.isnan(spl(make_trajectory(DETOUR, layout=outside)))
