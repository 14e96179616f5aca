"""R-GCN and GAT in compiled code: the scores of the layers on DGL, from the checkpoint's tensors."""

import numpy as np
import pytest
import torch

from reward_model.fast.from_checkpoint import tensor_shapes
from reward_model.networks.checkpoint import Checkpoint, CheckpointError
from reward_model.networks.registry import GATConfig, NetworkConfig, RGCNConfig
from reward_model.scorer import SocialScorer
from tests.reward_model.random_scenes import random_windows

# One layer sees the newest room's neighbours, four see all three frames; widths that are no multiples of a vector's.
CONFIGS = [
    RGCNConfig((42, 2), num_bases=3),
    RGCNConfig((42, 12, 9, 7, 2), num_bases=4),
    RGCNConfig((42, 12, 2), num_bases=24),
    GATConfig((42, 2), num_heads=3, negative_slope=0.2),
    GATConfig((42, 6, 5, 3, 2), num_heads=3, negative_slope=0.1),
    GATConfig((42, 4, 2), num_heads=1, negative_slope=0.0),
]
NAMES = [f"{config.kind}-{'-'.join(map(str, config.sizes))}" for config in CONFIGS]


def random_checkpoint(config: NetworkConfig) -> Checkpoint:
    generator = torch.Generator().manual_seed(4)
    tensors = {name: torch.randn(shape, generator=generator) / 4 for name, shape in tensor_shapes(config).items()}
    for name in tensors:
        if name.startswith(f"layers.{len(config.sizes) - 2}.") and "bias" in name:
            tensors[name] += 3  # or many scores would be 0
    return Checkpoint(config, tensors)


@pytest.fixture(params=CONFIGS, ids=NAMES)
def checkpoint(request):
    return random_checkpoint(request.param)


def test_scores_are_those_on_dgl(checkpoint):
    pytest.importorskip("dgl")
    windows = random_windows(70, count=12)
    scores, expected = (SocialScorer(checkpoint, "random", form).score_windows(windows) for form in ("compiled", "dgl"))
    assert scores.dtype == np.float32
    assert len(set(expected.flatten().tolist())) > 15
    np.testing.assert_allclose(scores, expected, atol=1e-4, rtol=1e-5)


def test_the_compiled_form_is_the_first_choice_and_needs_no_dgl(checkpoint, monkeypatch):
    windows = random_windows(71, count=2)
    expected = SocialScorer(checkpoint, "random", "compiled").score_windows(windows)

    def refuse(*_):
        raise AssertionError("DGL was asked for")

    monkeypatch.setattr("reward_model.scorer.network_on_dgl", refuse)
    np.testing.assert_array_equal(SocialScorer(checkpoint, "random").score_windows(windows), expected)


def test_a_batch_gives_the_bits_of_its_singles(checkpoint):
    windows = random_windows(72, count=19)
    scorer = SocialScorer(checkpoint, "random")
    singles = np.concatenate([scorer.score_windows([window]) for window in windows])
    np.testing.assert_array_equal(scorer.score_windows(windows), singles)
    np.testing.assert_array_equal(scorer.score_windows(windows[::-1]), singles[::-1])


def test_any_number_of_threads_gives_the_same_scores(checkpoint, monkeypatch):
    windows = random_windows(73, count=13)
    scorer = SocialScorer(checkpoint, "random")
    expected = scorer.score_windows(windows)
    monkeypatch.setattr(torch, "get_num_threads", lambda: 2)
    np.testing.assert_array_equal(scorer.score_windows(windows), expected)


def test_weights_of_another_precision_are_taken_as_they_are(checkpoint):
    windows = random_windows(74, count=3)
    doubles = {name: tensor.double() for name, tensor in checkpoint.tensors.items()}
    np.testing.assert_array_equal(
        SocialScorer(Checkpoint(checkpoint.config, doubles), "random").score_windows(windows),
        SocialScorer(checkpoint, "random").score_windows(windows),
    )


@pytest.mark.parametrize(
    ("config", "name", "tensor", "reason"),
    [
        (CONFIGS[1], "layers.1.h_bias", None, "layers.1.h_bias is missing"),
        (CONFIGS[1], "layers.0.linear_r.W", torch.zeros(4, 42, 2), r"layers.0.linear_r.W must have shape \(4, 4"),
        (CONFIGS[4], "layers.9.bias", torch.zeros(2), "layers.9.bias is not part of it"),
        (CONFIGS[4], "layers.1.attn_l", torch.zeros(1, 2, 5), r"layers.1.attn_l must have shape \(1, 3"),
    ],
)
def test_weights_that_do_not_fit(config, name, tensor, reason):
    checkpoint = random_checkpoint(config)
    if tensor is None:
        del checkpoint.tensors[name]
    else:
        checkpoint.tensors[name] = tensor
    with pytest.raises(CheckpointError, match=rf"^the weights do not fit the network {config.kind} .*: {reason}"):
        SocialScorer(checkpoint, "random")
