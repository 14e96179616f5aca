from dataclasses import replace

import numpy as np
import pytest
import torch

from reward_model.data.augmentation import mirrored
from reward_model.graph.windows import sequence_frames
from reward_model.networks.checkpoint import Checkpoint, CheckpointError, load_checkpoint, save_checkpoint
from reward_model.networks.registry import MPNNConfig
from reward_model.scenes.scene import SceneSequence, Scores
from reward_model.scorer import SocialScorer, load_scorer, weights_path
from tests.reward_model.graph.test_windows import NO_INTERACTIONS, hand_made, objects, people
from tests.reward_model.networks.test_factorised_mpnn import SIZES, random_network
from tests.reward_model.random_scenes import random_sequence, random_windows


def some_checkpoint(edge_network: str = "tabulated") -> Checkpoint:
    network = random_network(SIZES[-1], edge_network)
    return Checkpoint(MPNNConfig(SIZES[-1], edge_network), network.state_dict())


@pytest.fixture(scope="module")
def scorer():
    return SocialScorer(some_checkpoint(), "random")


@pytest.fixture
def sequences():
    rng = np.random.default_rng(5)
    return [random_sequence(rng, 1 + index % 3, 4, 3, index % 2 == 1) for index in range(6)]


@pytest.mark.parametrize("edge_network", ["perceptron", "tabulated"])
def test_both_forms_agree(edge_network):
    pytest.importorskip("dgl")
    windows = random_windows(50, count=6)
    compiled, original = (
        SocialScorer(some_checkpoint(edge_network), "random", form).score_windows(windows)
        for form in ("compiled", "dgl")
    )
    np.testing.assert_allclose(compiled, original, atol=1e-5)


def test_one_sequence_scores_as_in_any_batch(scorer, sequences):
    batch = scorer.score_batch(sequences)
    assert batch.shape == (6, 2)
    assert batch.dtype == np.float32
    assert [tuple(scorer.score(sequence)[:2]) for sequence in sequences] == [tuple(row) for row in batch.tolist()]
    np.testing.assert_array_equal(scorer.score_batch(sequences[::-1]), batch[::-1])
    first = scorer.score(sequences[0])
    assert isinstance(first, Scores)
    assert (first.q1, first.q2) == tuple(batch[0].tolist())


def test_nothing_to_score(scorer):
    assert scorer.score_batch([]).shape == scorer.score_windows([]).shape == (0, 2)


@pytest.mark.parametrize("number", [0, 4])
def test_windows_of_another_number_of_frames_are_refused(scorer, number):
    frame = sequence_frames(random_sequence(np.random.default_rng(0), 1))[0]
    with pytest.raises(ValueError, match=f"^window 1 must have 1 to 3 frames, got {number}$"):
        scorer.score_windows([[frame], [frame] * number])


def shuffled(sequence: SceneSequence, rng: np.random.Generator) -> SceneSequence:
    snapshots = []
    for snapshot in sequence:
        orders = rng.permutation(len(snapshot.people)), rng.permutation(len(snapshot.objects))
        arrays = [
            {name: values[order] for name, values in vars(entities).items()}
            for entities, order in zip((snapshot.people, snapshot.objects), orders, strict=True)
        ]
        pairs = rng.permutation(snapshot.interactions.pairs)[:, ::-1]
        snapshots.append(
            replace(
                snapshot,
                people=replace(snapshot.people, **arrays[0]),
                objects=replace(snapshot.objects, **arrays[1]),
                walls=snapshot.walls,
                interactions=replace(snapshot.interactions, pairs=pairs),
            )
        )
    return SceneSequence(tuple(snapshots))


def test_the_order_of_people_and_objects_does_not_matter(scorer, sequences):
    rng = np.random.default_rng(6)
    others = [shuffled(sequence, rng) for sequence in sequences]
    np.testing.assert_allclose(scorer.score_batch(others), scorer.score_batch(sequences), atol=1e-5)


def test_mirrored_twice_is_the_scene_itself(scorer, sequences):
    twice = [mirrored(mirrored(sequence)) for sequence in sequences]
    np.testing.assert_array_equal(scorer.score_batch(twice), scorer.score_batch(sequences))
    once = [mirrored(sequence) for sequence in sequences]
    assert not np.allclose(scorer.score_batch(once), scorer.score_batch(sequences), atol=1e-3)


def test_empty_places_are_finite(scorer):
    walls = np.array([[-3.0, -3, 3, -3], [3, -3, 3, 3], [3, 3, -3, 3], [-3, 3, -3, -3]])
    for there in (walls, np.zeros((0, 4))):
        nobody = hand_made(people=people(), objects=objects(), walls=there, interactions=NO_INTERACTIONS)
        assert np.isfinite(scorer.score(SceneSequence((nobody,)))).all()


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
def test_scores_on_a_gpu(scorer):
    windows = random_windows(60, count=7)
    on_gpu = SocialScorer(some_checkpoint(), "random", device="cuda")
    np.testing.assert_allclose(on_gpu.score_windows(windows), scorer.score_windows(windows), atol=1e-3)


def test_a_folder_is_loaded_and_names_the_scores(tmp_path, scorer, sequences):
    save_checkpoint(tmp_path / "mine", some_checkpoint())
    loaded = load_scorer(tmp_path / "mine")
    assert loaded.name == str(tmp_path / "mine")
    np.testing.assert_array_equal(loaded.score_batch(sequences), scorer.score_batch(sequences))


def test_unknown_weights():
    with pytest.raises(
        CheckpointError, match=r"^weights must be 'default', 'published' or a checkpoint folder, got 'n"
    ):
        load_scorer("nowhere")


def test_published_weights_that_were_not_imported(tmp_path, monkeypatch):
    monkeypatch.setenv("SOCNAV_CACHE", str(tmp_path))
    with pytest.raises(CheckpointError, match=r"`python -m reward_model import-published socnavgym==0\.1\.1`$"):
        weights_path("published")


def test_unknown_forms_and_devices():
    with pytest.raises(ValueError, match=r"^form must be one of \['auto', 'compiled', 'dgl'\], got 'fast'$"):
        SocialScorer(some_checkpoint(), "random", "fast")
    with pytest.raises(ValueError, match=r"^device must be one that PyTorch can use here, got 'quantum' \("):
        SocialScorer(some_checkpoint(), "random", device="quantum")


@pytest.mark.parametrize(
    ("name", "tensor", "reason"),
    [
        ("layers.0.bias", None, "layers.0.bias is missing"),
        ("layers.9.bias", torch.zeros(2), "layers.9.bias is not part of it"),
        ("layers.1.bias", torch.zeros(3), r"layers.1.bias must have shape \(6,\), got \(3,\)"),
    ],
)
def test_weights_that_do_not_fit(tmp_path, name, tensor, reason):
    checkpoint = some_checkpoint()
    if tensor is None:
        del checkpoint.tensors[name]
    else:
        checkpoint.tensors[name] = tensor
    save_checkpoint(tmp_path / "odd", checkpoint)
    assert name in load_checkpoint(tmp_path / "odd").tensors or tensor is None
    with pytest.raises(CheckpointError, match=rf"odd: the weights do not fit .* \(tabulated\): {reason}$"):
        load_scorer(tmp_path / "odd")
