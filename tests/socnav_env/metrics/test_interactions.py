import numpy as np
import pytest

from socnav_env.metrics import group_intrusion, interaction_crossings, interaction_time
from socnav_env.people.interactions import standing_groups
from socnav_env.trajectories.trajectory import Trajectory
from tests.socnav_env.episodes import make_trajectory
from tests.socnav_env.puppets import make_layout

TALKING, COUPLE, PLANT = "two_static_person_talking", "wandering_human_interacting", "human_plant_interaction"
PAIR = [[0.0, 1.0], [0.0, -1.0]]  # a line along the y axis


def among(robot, people, pairs, relation: str = TALKING) -> Trajectory:
    places = np.asarray(people, dtype=float)
    first = np.zeros((places.shape[-2], 3))
    first[:, :2] = places[0] if places.ndim == 3 else places
    layout = make_layout(
        people_poses=first,
        interaction_pairs=np.array(pairs, dtype=np.int64).reshape(-1, 2),
        interaction_relations=(relation,) * len(pairs),
    )
    return make_trajectory(robot, people=places, layout=layout)


@pytest.mark.parametrize(
    ("robot", "crossings"),
    [
        ([[-0.5, 0.0], [0.5, 0.0]], 1),
        ([[-0.5, 0.0], [0.5, 0.0], [-0.5, 0.5]], 2),
        ([[-0.5, 0.0], [0.0, 0.0], [0.5, 0.0]], 1),  # a step ends on the line
        ([[-0.5, 0.0], [0.0, 0.0], [-0.5, 0.0]], 0),  # up to the line and back
        ([[0.0, 0.0], [0.5, 0.0]], 0),  # starts on the line
        ([[-0.5, 1.1], [0.5, 1.1]], 0),  # past its end
        ([[-0.5, 0.8], [0.5, 1.3]], 0),  # at 1.05 where it comes by
        ([[-0.5, 0.6], [0.5, 1.3]], 1),  # at 0.95
        ([[-0.5, 0.0], [-0.1, 0.0]], 0),
    ],
)
def test_a_crossing_is_where_the_path_meets_the_line(robot, crossings: int) -> None:
    assert interaction_crossings(among(robot, PAIR, [(0, 1)])) == crossings


def test_a_line_that_moves_can_be_crossed_by_a_robot_that_stands() -> None:
    people = np.array([[[-0.5, 1.0], [-0.5, -1.0]], [[0.5, 1.0], [0.5, -1.0]]])
    assert interaction_crossings(among([[0.0, 0.0], [0.0, 0.0]], people, [(0, 1)], COUPLE)) == 1


def test_a_person_and_what_they_look_at_have_a_line_between_them() -> None:
    # The table stands at (-2, 0) and is entity 1, behind the only person.
    assert interaction_crossings(among([[-1.0, -1.0], [-1.0, 1.0]], [[0.0, 0.0]], [(0, 1)], PLANT)) == 1


def test_every_line_counts() -> None:
    people = [[0.0, 1.0], [0.0, -1.0], [0.5, 1.0], [0.5, -1.0]]
    assert interaction_crossings(among([[-1.0, 0.0], [1.0, 0.0]], people, [(0, 1), (2, 3)])) == 2
    assert interaction_crossings(among([[-1.0, 0.0], [1.0, 0.0]], people, [])) == 0


def test_interaction_time_counts_steps_with_the_surface_within_reach_of_a_line() -> None:
    # Surface 0.25 m around the centre: reach is 0.65 m from the line, and around its ends.
    robot = [[0.0, 0.0], [0.64, 0.0], [0.66, 0.0], [0.0, 1.64], [0.0, 1.66], [0.4, 1.4], [0.5, 1.5]]
    assert interaction_time(among(robot, PAIR, [(0, 1)])) == pytest.approx(3 * 0.2)
    assert interaction_time(among(robot, PAIR, [])) == 0.0


def test_the_circle_of_two_who_talk_has_them_at_its_ends() -> None:
    robot = [[0.0, 0.0], [0.99, 0.0], [1.01, 0.0], [0.7, 0.7], [0.72, 0.72]]
    assert group_intrusion(among(robot, PAIR, [(0, 1)])) == pytest.approx(50.0)
    assert group_intrusion(among(robot, PAIR, [(0, 1)], COUPLE)) == 0.0
    assert group_intrusion(among(robot, PAIR, [])) == 0.0


def test_conversations_in_a_chain_make_one_group() -> None:
    # The corners of an equilateral triangle, 1 m around the origin.
    people = [[1.0, 0.0], [-0.5, np.sqrt(0.75)], [-0.5, -np.sqrt(0.75)], [9.0, 9.0]]
    trajectory = among([[0.0, 0.0], [-0.99, 0.0], [-1.01, 0.0]], people, [(0, 1), (1, 2)])
    assert group_intrusion(trajectory) == pytest.approx(50.0)


def test_groups_grow_together() -> None:
    pairs = np.array([[0, 1], [2, 3], [4, 5], [1, 2]])
    relations = (TALKING, TALKING, COUPLE, TALKING)
    assert standing_groups(make_layout(interaction_pairs=pairs, interaction_relations=relations)) == [[0, 1, 2, 3]]
