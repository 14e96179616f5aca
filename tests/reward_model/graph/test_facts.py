import numpy as np
import pytest

from reward_model.graph.facts import FACTS, TrainingRange, facts_of
from reward_model.graph.star import Stars
from reward_model.graph.windows import frame_graph, wall_segments
from tests.reward_model.graph.test_frame import SQUARE
from tests.reward_model.graph.test_windows import NO_INTERACTIONS, hand_made, objects, people
from tests.reward_model.random_scenes import random_windows

ROOM = TrainingRange(
    {"extent": (3, 20), "people": (0, 30), "objects": (0, 9), "goal": (0, 15), "speed": (0, 1), "turn": (0, 0.5)}
)


def test_the_facts_of_a_scene():
    snapshot = hand_made(
        people=people((1.0, 0.5), (2.0, 0.0)),
        objects=objects((3.0, 0.0)),
        walls=SQUARE,
        interactions=NO_INTERACTIONS,
        goal=(3.0, -4.0),
        command=(-0.25, 0.0, 0.125),
    )
    facts = facts_of([[frame_graph(snapshot, wall_segments(snapshot.walls))]])
    np.testing.assert_allclose(facts, [[6.0, 2.0, 1.0, 5.0, 0.25, 0.125]], rtol=1e-6)


def test_stars_have_the_same_facts():
    windows = random_windows(8, count=6)
    np.testing.assert_allclose(facts_of(Stars.of_windows(windows)), facts_of(windows), rtol=1e-6)


def test_what_is_out_of_range_is_said_in_words():
    facts = np.array([[30.0, 40, 0, 25.0, 1.4, -0.0], [6.0, 2, 9, 15.0, 1.0, 0.5], [0.0, 0, 10, 1.0, 0.0, 0.9]])
    assert ROOM.exceeded(facts) == [
        ("room of 30 m", "40 people", "goal at 25 m", "robot at 1.4 m/s"),
        (),
        ("room of 0 m", "10 objects", "robot turning at 0.9 rad/s"),
    ]
    assert ROOM.contains(facts).tolist() == [False, True, False]


def test_a_range_is_that_of_its_data_and_survives_json():
    facts = np.random.default_rng(0).uniform(0, 5, (20, len(FACTS)))
    found = TrainingRange.of_document(TrainingRange.of_facts(facts).document())
    assert found.contains(facts).all()
    assert not found.contains(facts + 5).any()


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ({"extent": (0, 1)}, "a range must have"),
        ({**ROOM.limits, "goal": (3, 1)}, "goal must be two numbers, the smaller first"),
        ({**ROOM.limits, "goal": (3,)}, "goal must be two numbers"),
    ],
)
def test_limits_are_checked(limits, message):
    with pytest.raises(ValueError, match=message):
        TrainingRange(limits)
