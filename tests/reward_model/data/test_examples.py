import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from reward_model.data.augmentation import VARIANTS, judged_window, mirrored, rotated
from reward_model.data.examples import (
    DatasetError,
    Examples,
    check_apart,
    examples_of,
    part_of_scenes,
    split_by_scene,
    split_in_two,
)
from reward_model.graph.features import NUM_NODE_FEATURES
from reward_model.graph.windows import sequence_frames
from reward_model.networks.factorised_mpnn import FactorisedMPNN
from reward_model.scenes.scene import LabelledSequence, SceneSequence
from reward_model.training.fit import TrainingConfig, fit
from tests.reward_model.random_scenes import random_sequence

# Where a feature stands, and what becomes of it (SOCNAV2.md's layout): x to the right changes sign in the mirror,
# all that lies around the robot changes sign when the robot turns round.
X, Y, TURN_RATE, VELOCITY_X, VELOCITY_Y, SINE, COSINE = range(7)
PERSON, ROBOT, OBJECT, ROOM, WALL, GOAL = 8, 17, 19, 30, 32, 38


def mirror_signs() -> np.ndarray:
    """(42,) the sign of each feature in the mirror. An angle a becomes pi - a: its sine stays."""
    signs = np.ones(NUM_NODE_FEATURES)
    for start in (PERSON, OBJECT):
        signs[[start + X, start + TURN_RATE, start + VELOCITY_X, start + COSINE]] = -1
    signs[[ROBOT + 1, WALL, WALL + 2, GOAL]] = -1
    return signs


def turn_signs() -> np.ndarray:
    """(42,) the sign of each feature when the robot turns round; turn rates stay."""
    signs = np.ones(NUM_NODE_FEATURES)
    for start in (PERSON, OBJECT):
        signs[[start + X, start + Y, start + VELOCITY_X, start + VELOCITY_Y, start + SINE, start + COSINE]] = -1
    signs[[ROBOT, WALL, WALL + 1, WALL + 2, WALL + 3, GOAL, GOAL + 1]] = -1
    return signs


def labelled(scene: str, rater: str = "a", q1: float | None = 0.5, q2: float | None = None, clip: str = ""):
    seed = sum(map(ord, scene))
    sequence = replace(random_sequence(np.random.default_rng(seed), 2), name=clip or scene)
    return LabelledSequence(sequence, q1, q2, scene, rater)


def many(count: int = 200, augmentation="none") -> Examples:
    """Every second scene has two ratings."""
    rows = [labelled(str(number), rater) for number in range(count) for rater in "ab"[: 1 + number % 2]]
    return examples_of(rows, augmentation)


@pytest.mark.parametrize(("change", "signs"), [(mirrored, mirror_signs()), (rotated, turn_signs())])
def test_augmentation_is_exact_in_the_features(change, signs):
    sequence = random_sequence(np.random.default_rng(1), 3, 4, 3)
    for before, after in zip(sequence_frames(sequence), sequence_frames(change(sequence)), strict=True):
        np.testing.assert_allclose(after.arrays.features, before.arrays.features * signs, atol=1e-6)
        np.testing.assert_allclose(after.arrays.lengths, before.arrays.lengths, atol=1e-7)
        np.testing.assert_array_equal(after.arrays.link_relations, before.arrays.link_relations)
        np.testing.assert_array_equal(after.arrays.link_sources, before.arrays.link_sources)
        np.testing.assert_allclose(after.arrays.link_lengths, before.arrays.link_lengths, atol=1e-6)


def test_the_four_variants_are_the_group_of_the_two_changes():
    sequence = random_sequence(np.random.default_rng(1), 3, 4, 3)
    before = sequence_frames(sequence)[0].arrays.features
    signs = (np.ones(NUM_NODE_FEATURES), mirror_signs(), turn_signs(), mirror_signs() * turn_signs())
    for change, expected in zip(VARIANTS["all"], signs, strict=True):
        np.testing.assert_allclose(sequence_frames(change(sequence))[0].arrays.features, before * expected, atol=1e-6)


def test_the_judged_window_has_the_same_frames():
    snapshots = random_sequence(np.random.default_rng(2), 3).snapshots
    times = (0.0, 0.3, 1.1, 1.2, 2.4)
    sequence = SceneSequence(tuple(replace(snapshots[index % 3], timestamp=time) for index, time in enumerate(times)))
    window = judged_window(sequence)
    assert [snapshot.timestamp for snapshot in window] == [0.0, 1.2, 2.4]
    for one, other in zip(sequence_frames(window), sequence_frames(sequence), strict=True):
        np.testing.assert_array_equal(one.arrays.features, other.arrays.features)


def test_augmented_copies_follow_their_original_with_its_scores():
    examples = examples_of([labelled("1", q1=0.2), labelled("2", "b", None, 0.7)], "all")
    assert examples.variants.tolist() == [0, 1, 2, 3] * 2
    assert examples.scenes == ("1",) * 4 + ("2",) * 4
    assert examples.raters == ("a",) * 4 + ("b",) * 4
    np.testing.assert_array_equal(examples.scores[::4], np.float32([[0.2, np.nan], [np.nan, 0.7]]))
    assert len(examples.originals()) == 2
    assert examples.originals().windows[1] is examples.windows[4]


def test_ratings_and_copies_of_one_scene_stay_in_one_part():
    examples = many(augmentation="mirror")
    parts = split_by_scene(examples, 0.2)
    check_apart(parts)
    assert sorted(scene for part in parts.values() for scene in set(part.scenes)) == sorted(map(str, range(200)))
    assert 20 < len(set(parts["test"].scenes)) < 60
    assert set(parts["train"].variants.tolist()) == {0, 1}
    assert not parts["test"].variants.any() and not parts["development"].variants.any()
    assert len(parts["train"]) + 2 * len(parts["test"]) + 2 * len(parts["development"]) == len(examples)


def test_a_scene_stays_in_its_part_when_others_come():
    few, more = (split_by_scene(many(count), 0.2)["test"].scenes for count in (100, 200))
    assert set(few) == {scene for scene in more if int(scene) < 100}
    assert set(split_by_scene(many(100), 0.2, seed=1)["test"].scenes) != set(few)
    assert part_of_scenes(many(100), "test", 0.2).scenes == few


@pytest.mark.parametrize("held_out", [0.0, 0.5, math.nan])
def test_impossible_shares(held_out):
    with pytest.raises(DatasetError, match=f"^held_out must lie between 0 and 0.5, got {held_out}$"):
        split_by_scene(many(3), held_out)


def test_too_few_scenes_to_split():
    with pytest.raises(DatasetError, match=r"^no scene falls into the \w+ part of 1 scenes; raise held_out, choose"):
        split_by_scene(many(1), 0.1)


def test_a_scene_in_two_parts_is_refused():
    with pytest.raises(DatasetError, match=r"^scene '3' must be in one part only, it is in train and test$"):
        check_apart({"train": many(4), "test": examples_of([labelled("3")])})


def test_a_clip_is_trained_on_once_with_its_mean_score():
    """Scene 1 is shown in two clips, one of them to two people, of whom one was asked for Q2."""
    rows = [
        labelled("1", "a", 0.2, clip="1 A"),
        labelled("1", "b", 0.6, 0.9, clip="1 A"),
        labelled("1", "a", 0.5, clip="1 B"),
    ]
    examples = examples_of(rows, "mirror")
    alike, by_scores = examples.labelled_clips(alike=True), examples.labelled_clips(alike=False)
    expected = np.float32([[0.4, 0.9], [0.4, 0.9], [0.5, np.nan], [0.5, np.nan]])
    for data in (alike, by_scores):
        np.testing.assert_array_equal(data.scores, expected)
        assert [window is examples.windows[row] for window, row in zip(data.windows, (0, 1, 4, 5), strict=True)]
    assert alike.weights is None
    assert by_scores.weights.tolist() == [[2, 1], [2, 1], [1, 0], [1, 0]]
    assert examples.labelled().weights is None and len(examples.labelled()) == 6
    assert examples.ratings().of_question(0)["1 B"] == [("a", 0.5), ("a", 0.5)]


def test_means_have_the_gradient_of_all_scores():
    rows = [labelled("1", "a", 0.2, clip="A"), labelled("1", "b", 0.6, clip="A"), labelled("2", "a", 0.9, clip="B")]
    examples = examples_of(rows)
    states = []
    for data in (examples.labelled(), examples.labelled_clips(alike=False)):
        torch.manual_seed(0)
        network = FactorisedMPNN((42, 4, 2), "tabulated")
        fit(network, data, examples.labelled(), TrainingConfig(max_epochs=3, batch_size=3))
        states.append(network.state_dict())
    for name, tensor in states[0].items():
        torch.testing.assert_close(tensor, states[1][name], atol=1e-5, rtol=1e-4)


def test_the_newest_frames_alone():
    examples = many(5)
    newest = examples.newest(1)
    assert [len(window) for window in newest.windows] == [1] * len(examples)
    assert newest.windows[-1][0] is examples.windows[-1][0]
    assert [len(window) for window in newest.chosen([0, 3]).newest(2).windows[:2]] == [1, 1]


def test_two_parts_for_data_that_is_tested_elsewhere():
    examples = many(augmentation="mirror")
    parts, three = split_in_two(examples, 0.2), split_by_scene(examples, 0.2)
    assert list(parts) == ["train", "development"]
    assert parts["development"].scenes == three["development"].scenes
    assert set(parts["train"].scenes) == set(three["train"].scenes) | set(three["test"].scenes)
    assert len(parts["train"]) == len(three["train"]) + 2 * len(three["test"])


def test_moments_share_their_frames():
    sequence = random_sequence(np.random.default_rng(0), 2)
    last = sequence.last
    long = replace(sequence, snapshots=tuple(replace(last, timestamp=float(time)) for time in np.linspace(0, 4, 35)))
    examples = examples_of([LabelledSequence(long, 0.5, 0.25, "s", "r")], "moments")
    assert [len(window) for window in examples.windows] == [3, 3, 3, 3]
    assert examples.variants.tolist() == [0, 1, 2, 3]
    assert examples.windows[0][1] is examples.windows[1][0]
    assert len({id(frame) for window in examples.windows for frame in window}) == 8
    assert examples.scores.tolist() == [[0.5, 0.25]] * 4
