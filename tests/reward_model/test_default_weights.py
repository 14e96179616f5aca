"""What the weights that ship hold in every scene, by construction or by what they learned."""

import numpy as np
import pytest
import torch

from reward_model.analysis.heatmap import is_inside, placed
from reward_model.data.augmentation import mirrored
from reward_model.graph.windows import reversed_walls, sequence_frames
from reward_model.networks.building import trained_network
from reward_model.networks.checkpoint import load_checkpoint
from reward_model.networks.star import in_contact
from reward_model.scenes.scene import SceneSequence
from reward_model.scorer import SocialScorer, load_scorer, weights_path
from socnav_env.simulated_data.windows import wide_episode, windows_of_episodes
from tests.reward_model.random_scenes import random_sequence


@pytest.fixture(scope="module")
def scorer() -> SocialScorer:
    return load_scorer("default")


@pytest.fixture(scope="module")
def sequences() -> list[SceneSequence]:
    """Scenes of any kind, most of them like none in a training."""
    rng = np.random.default_rng(11)
    return [random_sequence(rng, 1 + index % 3, index % 9, index % 4) for index in range(60)]


def test_scores_lie_within_0_and_1(scorer, sequences):
    scores = scorer.score_batch(sequences)
    assert (scores >= 0).all()
    assert (scores <= 1).all()


def test_left_and_right_and_the_direction_of_walls_say_nothing(scorer, sequences):
    scores = scorer.score_batch(sequences)
    np.testing.assert_allclose(scorer.score_batch([mirrored(each) for each in sequences]), scores, atol=1e-5)
    windows = [[reversed_walls(frame) for frame in sequence_frames(each)] for each in sequences]
    np.testing.assert_array_equal(scorer.score_windows(windows), scores)


def test_contacts_score_at_most_a_twentieth_and_others_not_always(scorer):
    windows = windows_of_episodes(wide_episode, 99, range(15))
    touching = in_contact(np.array([window[0].surroundings for window in windows], dtype=np.float32))
    scores = scorer.score_windows(windows)
    assert touching.sum() > 5
    assert scores[touching].max() <= 0.05
    assert scores[~touching].mean() > 0.3


def test_a_robot_on_a_person_is_not_welcome(scorer):
    sequence = random_sequence(np.random.default_rng(3), 3, 4, 2)
    for place in sequence.last.people.poses[:, :2]:
        if is_inside(sequence.last.walls, place[None])[0]:
            assert scorer.score(placed(sequence, place)).q1 <= 0.05


def test_their_members_disagree_and_their_range_is_known(scorer, sequences):
    found = scorer.assess_windows([sequence_frames(each) for each in sequences])
    assert found.deviations.min() >= 0
    assert found.deviations.max() > 0.01
    crowd = random_sequence(np.random.default_rng(0), 1, num_people=40)
    (reasons,) = scorer.out_of_range([sequence_frames(crowd)])
    assert "40 people" in reasons
    assert not scorer.score(crowd).in_range


def test_they_are_small():
    folder = weights_path("default")
    assert sum(path.stat().st_size for path in folder.iterdir()) < 4e6


def test_compiled_scores_are_those_of_the_definition(scorer, sequences):
    windows = [sequence_frames(each) for each in sequences]
    network = trained_network(load_checkpoint(weights_path("default"))).eval()
    with torch.no_grad():
        expected = network.scores_and_deviations(windows).numpy()
    found = scorer.assess_windows(windows)
    np.testing.assert_allclose(np.hstack([found.scores, found.deviations]), expected, atol=1e-4)
