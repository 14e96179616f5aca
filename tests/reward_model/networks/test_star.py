import numpy as np
import pytest
import torch

from reward_model.data.augmentation import mirrored
from reward_model.graph.frame import Surroundings
from reward_model.graph.windows import reversed_walls, sequence_frames
from reward_model.networks.registry import StarConfig
from reward_model.networks.star import CONTACT_SCORE, StarNetwork, in_contact, row_widths
from tests.reward_model.random_scenes import random_sequence, random_windows

SIZES = (42, 12, 8, 2)


@pytest.fixture(scope="module")
def network() -> StarNetwork:
    """Three members with the statistics of some windows, and answers that are far apart."""
    with torch.random.fork_rng():
        torch.manual_seed(3)
        network = StarNetwork(SIZES, 3)
    windows = random_windows(1, 30)
    network.prepare(windows)
    for member in network.members:
        member.scores.weight.data *= 10
    with torch.no_grad():
        for _ in range(20):
            network.train().training_answers(windows)
    return network.eval()


def assess(network: StarNetwork, windows) -> np.ndarray:
    with torch.no_grad():
        return network.scores_and_deviations(windows).numpy()


def with_surroundings(windows, *values: float):
    """The windows with other surroundings in their newest frames."""
    surroundings = np.array(values, dtype=np.float32)
    return [[window[0].replaced(surroundings=surroundings), *window[1:]] for window in windows]


def test_the_mirror_image_has_the_same_scores(network):
    rng = np.random.default_rng(5)
    sequences = [random_sequence(rng, 1 + index % 3, 5, 3, index % 2 == 1) for index in range(12)]
    one, other = (
        assess(network, with_surroundings(map(sequence_frames, each), 9, 9, 9, 9))
        for each in (sequences, map(mirrored, sequences))
    )
    assert np.ptp(one[:, :2], axis=0).min() > 0.05
    np.testing.assert_allclose(one, other, atol=1e-6)


def test_the_direction_of_walls_says_nothing(network):
    windows = random_windows(6, 5)
    turned = [[reversed_walls(frame) for frame in window] for window in windows]
    np.testing.assert_array_equal(assess(network, windows), assess(network, turned))


def test_scores_are_the_members_mean_and_lie_within_0_and_1(network):
    windows = with_surroundings(random_windows(7, 12), 9, 9, 9, 9)
    with torch.no_grad():
        members = network.training_answers(windows).numpy()
    assert members.shape == (3, 12, 2)
    assert ((members > 0) & (members < 1)).all()
    found = assess(network, windows)
    np.testing.assert_allclose(found[:, :2], members.mean(axis=0), atol=1e-6)
    np.testing.assert_allclose(found[:, 2:], members.std(axis=0), atol=1e-6)
    assert members.std(axis=0).max() > 0.01


@pytest.mark.parametrize(
    ("surroundings", "touching"),
    [
        ((0.51, 0.26, 0.26, 9.0), False),
        ((0.5, 9.0, 9.0, 9.0), True),
        ((9.0, 0.25, 9.0, 9.0), True),
        ((9.0, 9.0, 0.25, 9.0), True),
        ((np.inf, np.inf, np.inf, 0.0), False),
    ],
)
def test_in_contact_scores_are_at_most_a_twentieth(network, surroundings, touching):
    windows = random_windows(8, 10)
    found = assess(network, with_surroundings(windows, *surroundings))[:, :2]
    assert bool(in_contact(np.array([Surroundings(*surroundings)], dtype=np.float32))[0]) is touching
    assert bool(found.max() <= CONTACT_SCORE) is touching


def test_a_network_that_is_not_prepared_learns_from_standardised_inputs(network):
    fresh = StarNetwork(SIZES, 1)
    windows = random_windows(9, 20)
    fresh.prepare(windows)
    mean, deviation = fresh.inputs["rooms"].mean, fresh.inputs["rooms"].deviation
    assert (mean[-6:] == 0).all()  # odd columns
    assert (deviation > 0).all()


def test_other_kinds_have_half_the_features_of_people():
    assert row_widths(20) == {"people": 20, "objects": 10, "walls": 10, "pairs": 10}


def test_a_round_has_at_least_two_features():
    with pytest.raises(ValueError, match=r"hidden sizes of at least 2, got \[1\]"):
        StarConfig((42, 1, 2))
    with pytest.raises(ValueError, match=r"hidden sizes of at least 2, got \[\]"):
        StarConfig((42, 2))
