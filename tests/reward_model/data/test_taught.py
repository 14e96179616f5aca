import numpy as np
import pytest

from reward_model.data.taught import TEACHER_RANGE, TaughtWindows
from reward_model.graph.facts import FACTS, facts_of
from reward_model.graph.star import Stars
from tests.reward_model.random_scenes import random_windows

NOTHING = (9.0, 9.0, 9.0, 8.0)  # distances to people, objects, walls, and the room's extent


def taught(images, *surroundings) -> TaughtWindows:
    windows = random_windows(0, len(surroundings))
    windows = [
        [each[0].replaced(surroundings=np.array(around, dtype=np.float32)), *each[1:]]
        for each, around in zip(windows, surroundings, strict=True)
    ]
    return TaughtWindows(Stars.of_windows(windows), np.array(images, dtype=np.float32))


def test_the_symmetrised_answer_is_the_mean_of_four_within_0_and_1():
    images = [[[0.2, 0.8], [0.4, 0.8], [0.6, 0.8], [0.8, 0.8]], [[1.2, -0.4], [1.2, 0.0], [1.0, 0.0], [1.0, 0.2]]]
    found = taught(images, NOTHING, NOTHING).symmetrised
    np.testing.assert_allclose(found, [[0.5, 0.8], [1.0, 0.0]], atol=1e-6)


def test_contacts_are_bad_and_shallow_overlaps_unknown():
    good = np.full((5, 4, 2), 0.75)
    good[4] = 0.01
    surroundings = [NOTHING, (0.45, 9, 9, 8), (0.35, 9, 9, 8), (9, 0.0, 9, 8), (9, 9, 0.1, 8)]
    found = taught(good, *surroundings).to_learn().scores
    expected = [[0.75] * 2, [np.nan] * 2, [0.05] * 2, [0.05] * 2, [0.01] * 2]
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_windows_in_the_teachers_range_are_out_of_contact():
    images = np.full((3, 4, 2), 0.5)
    found = taught(images, NOTHING, (0.4, 9, 9, 8), (9, 9, 9, 30))
    facts = facts_of(found.stars)
    assert TEACHER_RANGE.contains(facts).tolist() == [True, True, False]
    assert found.touching.tolist() == [False, True, False]
    assert found.in_teacher_range.tolist() == [True, False, False]


@pytest.mark.parametrize("fact", FACTS)
def test_the_range_has_every_fact(fact):
    low, high = TEACHER_RANGE.limits[fact]
    assert 0 <= low < high
