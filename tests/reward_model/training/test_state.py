"""An interrupted training ends like one that is not interrupted."""

import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import torch

from reward_model.commands.main import main
from reward_model.data.labelled_windows import LabelledWindows
from reward_model.networks.building import trainable_network
from reward_model.networks.registry import GATConfig, MPNNConfig, RGCNConfig
from reward_model.training.fit import TrainingConfig, fit
from reward_model.training.state import TrainingState, TrainingStateError, load_state, save_state
from tests.reward_model.training.test_fit import labelled

CONFIGS = {
    "mpnn": MPNNConfig((42, 8, 2), "tabulated"),
    "perceptron": MPNNConfig((42, 4, 2), "perceptron"),
    "rgcn": RGCNConfig((42, 12, 2), num_bases=4, dropout=0.2),
    "gat": GATConfig((42, 6, 2), num_heads=3, negative_slope=0.2, dropout=0.2),
}


class Interrupted(Exception):
    pass


def network_of(name: str):
    if name != "mpnn":
        pytest.importorskip("dgl")
    return trainable_network(CONFIGS[name], 0)


@pytest.mark.parametrize("name", sorted(CONFIGS))
def test_a_resumed_training_has_the_same_curve_and_weights(name, tmp_path):
    data, development = labelled(), labelled(4, seed=1)
    config = TrainingConfig(max_epochs=6, batch_size=3, learning_rate=1e-2, patience=6)
    whole = network_of(name)
    history = fit(whole, data, development, config)

    def interrupt(epoch):
        if epoch.number == 3:
            raise Interrupted

    with pytest.raises(Interrupted):
        fit(network_of(name), data, development, config, interrupt, tmp_path / "state")
    torch.rand(7)  # whatever else happened in between
    resumed, seen = network_of(name), []
    again = fit(resumed, data, development, config, seen.append, tmp_path / "state", resume=True)
    assert again == history == seen
    for key, tensor in whole.state_dict().items():
        assert torch.equal(tensor, resumed.state_dict()[key])


def test_a_training_that_was_over_stays_over(tmp_path):
    data, config = labelled(), TrainingConfig(max_epochs=2)
    history = fit(network_of("mpnn"), data, data, config, state_file=tmp_path / "state")
    before = (tmp_path / "state").read_bytes()
    assert fit(network_of("mpnn"), data, data, config, state_file=tmp_path / "state", resume=True) == history
    assert (tmp_path / "state").read_bytes() == before


def test_training_leaves_the_global_generator_alone():
    pytest.importorskip("dgl")
    before = torch.get_rng_state()
    fit(network_of("rgcn"), labelled(), labelled(), TrainingConfig(max_epochs=1))
    assert torch.equal(torch.get_rng_state(), before)


@pytest.mark.parametrize(
    ("options", "other_data", "message"),
    [
        ({"batch_size": 4}, False, "batch_size was 3, got 4"),
        ({"seed": 1}, False, "seed was 0, got 1"),
        ({}, True, "train_data was "),
    ],
)
def test_the_state_of_another_training_is_refused(tmp_path, options, other_data, message):
    data = labelled()
    fit(network_of("mpnn"), data, data, TrainingConfig(max_epochs=1, batch_size=3), state_file=tmp_path / "state")
    now = labelled(seed=5) if other_data else data
    config = TrainingConfig(**{"max_epochs": 1, "batch_size": 3} | options)
    with pytest.raises(TrainingStateError, match=f"state: a training is gone on with as it was begun, {message}"):
        fit(network_of("mpnn"), now, data, config, state_file=tmp_path / "state", resume=True)


def test_what_was_saved_is_loaded(tmp_path):
    tensors = {"a": torch.tensor([1, 2], dtype=torch.uint8), "b.c": torch.rand(2, 3).T}
    save_state(tmp_path / "state", TrainingState({"seed": 1}, {"big": 2**127 + 1, "rate": 0.1 + 0.2}, tensors))
    state = load_state(tmp_path / "state", {"seed": 1})
    assert state.progress == {"big": 2**127 + 1, "rate": 0.1 + 0.2}
    assert all(torch.equal(state.tensors[name], tensor) for name, tensor in tensors.items())


def test_resuming_needs_a_place():
    with pytest.raises(ValueError, match=r"^resume needs the state_file of the training to go on with$"):
        fit(network_of("mpnn"), labelled(), labelled(), TrainingConfig(), resume=True)


def test_a_diverged_training_is_reported():
    network = network_of("mpnn")
    torch.nn.init.constant_(network.layers[0].bias, float("nan"))
    with pytest.raises(ValueError, match=r"^training got out of hand, no error is a number; lower learning_rate 0.5$"):
        fit(network, labelled(), labelled(), TrainingConfig(max_epochs=2, learning_rate=0.5))


@pytest.mark.parametrize("content", [b"", b"\x02\0\0\0\0\0\0\0{}", b"nonsense" * 9, None])
def test_broken_states_are_refused_in_one_line(tmp_path, content):
    path = tmp_path / "state"
    save_state(path, TrainingState({}, {}, {"a": torch.zeros(3)}))
    path.write_bytes(path.read_bytes()[:-5] if content is None else content)
    with pytest.raises(TrainingStateError, match=r"state: not a readable training state \(") as caught:
        load_state(path, {})
    assert "\n" not in str(caught.value)


def test_a_missing_state_is_refused(tmp_path):
    with pytest.raises(TrainingStateError, match=r"there is no training to go on with; start one without resume$"):
        load_state(tmp_path / "state", {})


def test_weights_change_what_counts():
    """A window of weight 0 has no effect: a training without it gives the same network."""
    data = labelled(6)
    weights = np.repeat(np.float32([[1], [1], [1], [1], [0], [0]]), 2, axis=1)
    whole = LabelledWindows(data.windows[:4], data.scores[:4])
    config = TrainingConfig(max_epochs=3, batch_size=6)
    states = []
    for used in (whole, LabelledWindows(data.windows, data.scores, weights)):
        network = network_of("mpnn")
        fit(network, used, labelled(4, seed=1), config)
        states.append(network.state_dict())
    for key, tensor in states[0].items():
        torch.testing.assert_close(tensor, states[1][key], atol=1e-5, rtol=1e-4)


def test_a_killed_training_goes_on_from_the_command_line(shared_data, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("SOCNAV_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")  # as in this process: sums depend on it
    ratings = (shared_data / "socnav1" / "dev.jsonl").read_text().splitlines()[:60]
    data, whole, killed = (tmp_path / name for name in ("ratings.jsonl", "whole", "killed"))
    data.write_text("\n".join(ratings))
    options = ("--held-out", "0.2", "--hidden-sizes", "4", "--max-epochs", "25", "--patience", "25", "--device", "cpu")
    command = ("train", "--data", str(data), *options, "--output")
    assert main([*command, str(whole)]) == 0
    arguments = [sys.executable, "-m", "reward_model", *command, str(killed)]
    with subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        while not (killed / "curve.csv").exists() and process.poll() is None:
            time.sleep(0.005)
        process.send_signal(signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    assert not (killed / "model.safetensors").exists()
    assert main([*command, str(killed), "--resume"]) == 0
    for name in ("curve.csv", "model.safetensors", "config.json"):
        assert (killed / name).read_bytes() == (whole / name).read_bytes()
