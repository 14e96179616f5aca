"""What holds for every network of the registry, as training and scoring see it."""

import numpy as np
import pytest
import torch

from reward_model.data.labelled_windows import LabelledWindows
from reward_model.graph.frame import FrameGraph
from reward_model.graph.windows import sequence_frames
from reward_model.networks.building import trainable_network
from reward_model.networks.checkpoint import Checkpoint, CheckpointError, load_checkpoint, save_checkpoint
from reward_model.networks.registry import NETWORKS, network_config
from reward_model.networks.window_network import WindowNetwork
from reward_model.scorer import SocialScorer, load_scorer
from reward_model.studies.search_space import SearchSpace
from reward_model.training.fit import TrainingConfig, errors, fit
from tests.reward_model.random_scenes import random_sequence, random_windows
from tests.reward_model.test_scorer import shuffled


@pytest.fixture(params=sorted(NETWORKS))
def config(request):
    if NETWORKS[request.param].trained_on_dgl:
        pytest.importorskip("dgl")
    return network_config(request.param, (42, 8, 6, 2), {})


@pytest.fixture
def network(config) -> WindowNetwork:
    """One that learned a little, as fresh ones often answer 0."""
    network = trainable_network(config, 3)
    fit(network, labelled(), labelled(), TrainingConfig(max_epochs=3, learning_rate=1e-2))
    return network


def labelled() -> LabelledWindows:
    scores = np.random.default_rng(1).uniform(0.1, 0.9, (8, 2)).astype(np.float32)
    windows = [[FrameGraph(*frame.arrays[:-1]) for frame in each] for each in random_windows(0, 8)]  # not in contact
    return LabelledWindows(windows, scores)


@torch.no_grad()
def answers(network: WindowNetwork, windows) -> torch.Tensor:
    return network.eval().answers(windows)


def test_a_batch_equals_its_singles(network):
    windows = random_windows(1, 9)
    batch = answers(network, windows)
    assert batch.shape == (9, 2)
    assert len(set(batch[:, 0].tolist())) == 9
    singles = torch.cat([answers(network, [window]) for window in windows])
    torch.testing.assert_close(batch, singles, atol=1e-5, rtol=0)


def test_the_order_of_people_and_objects_says_nothing(network):
    rng = np.random.default_rng(6)
    sequences = [random_sequence(rng, 1 + index % 3, 4, 3, index % 2 == 1) for index in range(6)]
    before, after = (
        answers(network, [sequence_frames(sequence) for sequence in each])
        for each in (sequences, [shuffled(sequence, rng) for sequence in sequences])
    )
    torch.testing.assert_close(before, after, atol=1e-5, rtol=0)


def test_eight_windows_are_learned_by_heart(config):
    network, data = trainable_network(config, 3), labelled()
    before = errors(network, data).mean()
    fit(network, data, data, TrainingConfig(max_epochs=150, patience=150, batch_size=4, learning_rate=1e-2))
    assert before > 0.03
    assert errors(network, data).max() < 0.01


def test_a_seed_says_with_which_weights_training_starts(config):
    before = torch.get_rng_state()
    first, same, other = (trainable_network(config, seed).state_dict() for seed in (1, 1, 2))
    assert torch.equal(torch.get_rng_state(), before)
    assert all(torch.equal(first[name], same[name]) for name in first)
    assert any(not torch.equal(first[name], other[name]) for name in first)


def test_a_checkpoint_scores_as_the_network_does(config, network, tmp_path):
    windows = random_windows(2, 9)
    save_checkpoint(tmp_path / "mine", Checkpoint(config, network.state_dict()))
    assert load_checkpoint(tmp_path / "mine").config == config
    expected = torch.relu(answers(network, windows)).numpy()
    assert (expected > 0).mean() > 0.5
    scorer = load_scorer(tmp_path / "mine")
    np.testing.assert_allclose(scorer.score_windows(windows), expected, atol=1e-4)
    np.testing.assert_array_equal(scorer.score_windows(windows[4:5]), scorer.score_windows(windows)[4:5])


def test_on_other_devices_pytorch_scores_where_no_dgl_is_needed(config, network, monkeypatch):
    """Here on the CPU, as if there were no compiled code."""
    from reward_model import scorer

    if NETWORKS[config.kind].trained_on_dgl:
        pytest.skip("runs on DGL there")
    windows, checkpoint = random_windows(2, 7), Checkpoint(config, network.state_dict())
    expected = SocialScorer(checkpoint, "compiled").score_windows(windows)
    without = {"compiled": ""}
    monkeypatch.setitem(NETWORKS, config.kind, type(NETWORKS[config.kind])(**vars(NETWORKS[config.kind]) | without))
    monkeypatch.setattr(scorer, "_LARGEST_BATCH", 3)
    np.testing.assert_allclose(SocialScorer(checkpoint, "padded").score_windows(windows), expected, atol=1e-5)


def test_weights_that_do_not_fit_are_refused(config, network):
    tensors = network.state_dict()
    missing = min(tensors)
    kept = {name: tensor for name, tensor in tensors.items() if name != missing}
    message = rf"^the weights do not fit the network {config.kind} 42-8-6-2.*: {missing} is missing$"
    with pytest.raises(CheckpointError, match=message):
        SocialScorer(Checkpoint(config, kept), "odd")


def test_a_search_draws_options_in_their_ranges(config):
    space = SearchSpace(blocks=(config.kind,))
    for number in range(5):
        params = space.draw(0, number).params
        drawn = space.network(params)
        assert drawn.kind == config.kind
        for name, field in config.option_fields().items():
            value = getattr(drawn, name)
            if field.option.search is None:
                assert value == field.default
            else:
                low, high = field.option.search
                assert low <= value == params[name] <= high
