import numpy as np
import pytest

from reward_model.analysis.synthetic_scenes import Person, SyntheticScene, Thing
from reward_model.graph.windows import select_window, sequence_frames
from reward_model.scenes.scene import ScenarioError, SceneSequence, Snapshot
from reward_model.scenes.time_scale import slowed
from reward_model.scorer import load_scorer

TABLE = Thing(1.0, -2.0, 0.3, 0.8, 0.6)


def scene(pace: float, turn: float = 0.0) -> SceneSequence:
    """A robot of 0.3 m/s and people of 0.4 and 0.2 m/s, at `pace` times these speeds."""
    people = [Person(2.0, 1.0, 2.0, 0.4 * pace), Person(-1.0, 1.5, -0.5, 0.2 * pace), Person(1.5, -1.0)]
    return SyntheticScene(
        (3.0, 1.0), command=(0.3 * pace, turn), people=people, objects=[TABLE], interactions=[(3, 4)]
    ).sequence()


def arrays_of(snapshot: Snapshot) -> list[np.ndarray]:
    people, objects = snapshot.people, snapshot.objects
    return [snapshot.command, people.velocities, objects.velocities, people.poses, objects.poses, snapshot.walls]


def test_times_grow_and_velocities_shrink() -> None:
    before, after = scene(4.0), slowed(scene(4.0), 4.0)
    assert [each.timestamp for each in after] == pytest.approx([0.8 * step for step in range(11)])
    np.testing.assert_allclose(after.last.command, [0.3, 0.0, 0.0])
    np.testing.assert_allclose(before.last.objects.velocities, [[-1.2, 0.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(after.last.objects.velocities, [[-0.3, 0.0, 0.0]], atol=1e-12)
    walking = [0.4 * np.cos(2.0) - 0.3, 0.4 * np.sin(2.0), 0.0]
    np.testing.assert_allclose(after.last.people.velocities[0], walking, atol=1e-12)
    np.testing.assert_array_equal(after.last.people.poses, before.last.people.poses)
    np.testing.assert_array_equal(after.last.goal, [3.0, 1.0])
    assert after.last.interval == 0.2
    assert after.name == before.name


def test_a_scene_at_its_own_pace_stays_as_it_is() -> None:
    sequence = scene(1.0)
    assert slowed(sequence, 1.0) is sequence


def test_slowing_twice_is_slowing_once_by_both_factors() -> None:
    twice, once = slowed(slowed(scene(4.0, 0.3), 2.0), 1.7), slowed(scene(4.0, 0.3), 3.4)
    for one, other in zip(twice, once, strict=True):
        assert one.timestamp == pytest.approx(other.timestamp)
        for mine, theirs in zip(arrays_of(one), arrays_of(other), strict=True):
            np.testing.assert_allclose(mine, theirs, rtol=1e-12)


def test_a_window_spans_two_seconds_of_slowed_time() -> None:
    assert select_window([each.timestamp for each in slowed(scene(2.5), 2.5)]) == [10, 8, 6]  # 0.4 s apart
    assert select_window([each.timestamp for each in slowed(scene(2.5), 2.7)]) == [10, 8, 6]
    assert select_window([each.timestamp for each in slowed(scene(2.5), 2.0)]) == [10, 7, 4]  # 0.5 s at least


def test_a_fast_scene_slowed_scores_as_the_slow_one() -> None:
    fast, slow = scene(2.5), scene(1.0)
    for frame, expected in zip(sequence_frames(slowed(fast, 2.5)), sequence_frames(slow), strict=True):
        np.testing.assert_allclose(frame.arrays.features, expected.arrays.features, atol=1e-6)
    scorer = load_scorer()
    assert scorer.score(slowed(fast, 2.5)) == pytest.approx(scorer.score(slow), abs=1e-5)
    assert scorer.score(fast) != pytest.approx(scorer.score(slow), abs=1e-3)


@pytest.mark.parametrize("factor", [0.0, -1.0, float("nan"), float("inf")])
def test_a_factor_is_a_positive_number(factor: float) -> None:
    with pytest.raises(ValueError, match=f"time_scale must be a positive number, got {factor}"):
        slowed(scene(1.0), factor)


def test_numbers_that_grow_beyond_bounds_are_refused() -> None:
    with pytest.raises(ScenarioError, match="synthetic: snapshot 9: timestamp must be a finite number, got inf"):
        slowed(scene(1.0), 1e308)
    with pytest.raises(ScenarioError, match="must be finite numbers"), np.errstate(over="ignore"):
        slowed(scene(1.0), 1e-320)
