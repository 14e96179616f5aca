import copy

import numpy as np
import pytest
import torch

from reward_model.data.labelled_windows import LabelledWindows
from reward_model.networks.factorised_mpnn import FactorisedMPNN
from reward_model.training.fit import Epoch, TrainingConfig, errors, fit
from tests.reward_model.random_scenes import random_windows

SIZES = (42, 16, 8, 2)


def new_network(seed: int = 0) -> FactorisedMPNN:
    torch.manual_seed(seed)
    return FactorisedMPNN(SIZES, "tabulated")


def labelled(count: int = 8, seed: int = 0) -> LabelledWindows:
    scores = np.random.default_rng(seed).uniform(0.1, 0.9, (count, 2)).astype(np.float32)
    return LabelledWindows(random_windows(seed, count), scores)


def with_scores(data: LabelledWindows, scores) -> LabelledWindows:
    return LabelledWindows(data.windows, np.broadcast_to(np.float32(scores), (len(data), 2)).copy())


def test_a_network_learns_eight_graphs_by_heart():
    data = labelled()
    network = new_network()
    before = errors(network, data).mean()
    history = fit(network, data, data, TrainingConfig(max_epochs=100, patience=100, batch_size=4, learning_rate=1e-2))
    assert before > 0.05
    assert errors(network, data).max() < 2e-3
    assert history[-1].number == len(history)


def test_the_same_seed_gives_the_same_network():
    data, development = labelled(), labelled(4, seed=1)
    histories, states = [], []
    for seed in (3, 3, 4):
        network = new_network()
        histories.append(fit(network, data, development, TrainingConfig(max_epochs=4, batch_size=3, seed=seed)))
        states.append(network.state_dict())
    assert histories[0] == histories[1] != histories[2]
    for name, tensor in states[0].items():
        assert torch.equal(tensor, states[1][name])


def test_training_stops_when_development_gets_no_better_and_keeps_the_best():
    data = labelled()
    high, low = with_scores(data, 1.0), with_scores(data, 0.0)
    network = new_network()
    torch.nn.init.constant_(network.layers[-1].bias, 0.5)
    seen = []
    config = TrainingConfig(max_epochs=100, patience=3, learning_rate=2e-3)
    history = fit(network, high, low, config, after_epoch=seen.append)
    best = min(history, key=lambda epoch: epoch.development_error)
    assert seen == history
    assert [type(epoch) for epoch in history] == [Epoch] * len(history)
    assert len(history) == best.number + 3 < 100
    assert float(errors(network, low).mean()) == best.development_error


def test_training_ends_after_its_epochs_in_evaluation_mode():
    network = new_network()
    history = fit(network, labelled(), labelled(), TrainingConfig(max_epochs=2))
    assert [epoch.number for epoch in history] == [1, 2]
    assert not network.training


def test_errors_by_hand():
    """A network whose last layer is its bias alone predicts 0.5 and, after the final ReLU, 0."""
    network = new_network()
    for parameter in network.layers[-1].parameters():
        torch.nn.init.constant_(parameter, 0.0)
    with torch.no_grad():
        network.layers[-1].bias[:] = torch.tensor([0.5, -3.0])
    scores = np.array([[0.5, 0.5], [1.0, np.nan], [np.nan, 0.1]], dtype=np.float32)
    data = LabelledWindows(random_windows(2, 3), scores)
    assert errors(network, data).tolist() == pytest.approx([0.25 / 2, (0.25 + 0.01) / 2])


def test_errors_are_the_same_in_any_number_of_batches():
    data = labelled(3)
    many = LabelledWindows(list(data.windows) * 100, np.tile(data.scores, (100, 1)))
    np.testing.assert_allclose(errors(new_network(), many), errors(new_network(), data), rtol=1e-5)


def test_questions_that_were_not_asked_do_not_count():
    """Where Q2 is missing everywhere, the weights that only Q2 depends on do not change."""
    data = labelled()
    data.scores[:, 1] = np.nan
    network = new_network()
    before = copy.deepcopy(network.state_dict())
    development = labelled(4, seed=1)
    config = TrainingConfig(max_epochs=3, weight_decay=0.0)
    history = fit(network, data, development, config)
    after = network.state_dict()
    assert all(np.isfinite(epoch.train_error) for epoch in history)
    assert torch.equal(after["layers.2.edge_func.plain"][..., 1], before["layers.2.edge_func.plain"][..., 1])
    assert torch.equal(after["layers.2.bias"][1], before["layers.2.bias"][1])
    assert not torch.equal(after["layers.2.bias"][0], before["layers.2.bias"][0])


def test_one_question_alone_can_be_trained_on():
    """As with SocNav1, which has no Q2."""
    data = labelled()
    data.scores[:, 1] = np.nan
    network = new_network()
    before = errors(network, data)
    history = fit(network, data, data, TrainingConfig(max_epochs=10))
    after = errors(network, data)
    assert np.isnan(before[1]) and np.isnan(after[1])
    assert after[0] < 0.5 * before[0]
    assert min(epoch.development_error for epoch in history) == after[0]


def test_windows_without_any_score_count_nothing():
    data = labelled()
    data.scores[:6] = np.nan
    network = new_network()
    history = fit(network, data, data, TrainingConfig(max_epochs=2, batch_size=1))
    assert all(np.isfinite(epoch.train_error) for epoch in history)
    assert all(torch.isfinite(parameter).all() for parameter in network.parameters())


@pytest.mark.parametrize("name", ["train", "development"])
def test_data_without_any_score_is_refused(name):
    data, nothing = labelled(), with_scores(labelled(), np.nan)
    pair = (nothing, data) if name == "train" else (data, nothing)
    with pytest.raises(ValueError, match=f"^the {name} windows must hold at least one score, got 8 windows without"):
        fit(new_network(), *pair, TrainingConfig(max_epochs=1))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"max_epochs": 0}, "max_epochs must be positive, got 0"),
        ({"patience": -1}, "patience must be positive, got -1"),
        ({"batch_size": 0}, "batch_size must be positive, got 0"),
        ({"learning_rate": 0.0}, "learning_rate must be positive, got 0.0"),
        ({"learning_rate": float("nan")}, "learning_rate must be positive, got nan"),
    ],
)
def test_impossible_configs(values, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        TrainingConfig(**values)
