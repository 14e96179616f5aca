import json
import pickle
import shutil
import zipfile
from dataclasses import replace

import numpy as np
import pytest
import torch

from reward_model import load_scorer, read_socnav2
from reward_model.graph.windows import scene_graph, sequence_frames
from reward_model.networks.checkpoint import load_checkpoint
from reward_model.published import STATE_FILE, PublishedWeightsError, import_published
from reward_model.scenes.scene import SceneSequence
from socnav_env.simulated_data.windows import generate_windows

REFERENCES = [
    name + ending
    for name in ("S1_000000", "S1_000003", "S2F_000000", "S2_000000", "S3I_000000", "S3nI_000000")
    for ending in ("", "[:-3]")
]
PUBLISHED_NAMES = ["NNconv_input", "layers.0", "layers.1", "layers.2", "layers.3", "NNConv_output"]
SIZES = [42, 40, 30, 21, 12, 3, 2]
HIDDEN = [(573, 1124), (412, 805), (222, 425), (96, 173), (24, 29), (13, 10)]  # as the published file has them


@pytest.fixture(scope="module", params=["compiled", "dgl"])
def scorer(request, published_weights):
    if request.param == "dgl":
        pytest.importorskip("dgl")
    return load_scorer("published", form=request.param)


@pytest.fixture(scope="module")
def references(shared_data):
    return json.loads((shared_data / "socnav2_samples" / "reference.json").read_text())


def sample(shared_data, name) -> SceneSequence:
    sequence = read_socnav2(shared_data / "socnav2_samples" / f"{name.removesuffix('[:-3]')}.json")
    return replace(sequence, snapshots=sequence.snapshots[:-3]) if name.endswith("[:-3]") else sequence


@pytest.mark.parametrize("name", REFERENCES)
def test_scores_are_those_of_the_published_code(shared_data, references, scorer, name):
    scores = scorer.score(sample(shared_data, name))
    assert scores.q1 == pytest.approx(references[name]["q1"], abs=1e-4)
    assert scores.q2 == pytest.approx(references[name]["q2"], abs=1e-4)


@pytest.mark.parametrize("name", REFERENCES)
def test_graphs_are_those_of_the_published_code(shared_data, references, name):
    expected = references[name]
    graph = scene_graph(sequence_frames(sample(shared_data, name)))
    assert len(graph.features) == expected["nodes"]
    assert len(graph.sources) == expected["edges"]
    assert graph.features.sum(dtype=float) == pytest.approx(expected["feature_sum"], rel=1e-4)
    assert graph.edge_features.sum(dtype=float) == pytest.approx(expected["edge_feature_sum"], rel=1e-4)


def test_one_batch_scores_like_one_by_one(shared_data, references, scorer):
    scores = scorer.score_batch([sample(shared_data, name) for name in REFERENCES])
    expected = [[references[name]["q1"], references[name]["q2"]] for name in REFERENCES]
    torch.testing.assert_close(torch.tensor(scores), torch.tensor(expected), atol=1e-4, rtol=0)


def test_both_forms_agree_on_generated_windows(published_weights):
    """`python -m benchmarks.scoring` compares them on 1,000."""
    pytest.importorskip("dgl")
    windows = generate_windows(8, seed=3)
    compiled, original = (load_scorer("published", form).score_windows(windows) for form in ("compiled", "dgl"))
    assert len({tuple(row) for row in original.tolist()}) > 4
    np.testing.assert_allclose(compiled, original, rtol=0, atol=5e-5)


def published_state() -> dict[str, torch.Tensor]:
    """Tensors of the published names and shapes; a tensor's value depends on its name."""
    state = {}
    for index, (name, (first, second)) in enumerate(zip(PUBLISHED_NAMES, HIDDEN, strict=True)):
        size = SIZES[index] * SIZES[index + 1]
        state[f"gnn_object.{name}.bias"] = torch.full((SIZES[index + 1],), index + 0.5)
        for layer, (before, after) in enumerate([(18, first), (first, second), (second, size)]):
            prefix = f"gnn_object.{name}.edge_func.{2 * layer}"
            state[f"{prefix}.weight"] = torch.full((after, before), index + 0.1 * layer)
            state[f"{prefix}.bias"] = torch.full((after,), -index - 0.1 * layer)
    return state


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("SOCNAV_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def unpacked(folder, state):
    path = folder / STATE_FILE
    path.parent.mkdir(parents=True, exist_ok=True)
    torch.save(state, path)
    return folder


def wheel(path, member, content):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(member, content)
    return path


def test_names_change_and_denormals_become_zero(tmp_path, cache):
    state = published_state()
    state["gnn_object.layers.3.bias"][:] = torch.tensor([1e-40, -1e-40, 1.2e-38])
    folder = import_published(unpacked(tmp_path / "site-packages", state))
    assert folder == cache / "published"
    checkpoint = load_checkpoint(folder)
    assert list(checkpoint.config.sizes) == SIZES
    assert checkpoint.config.edge_network == "perceptron"
    assert len(checkpoint.tensors) == 42
    assert sum(tensor.numel() for tensor in checkpoint.tensors.values()) == 4_286_204
    assert checkpoint.tensors["layers.4.bias"].tolist() == [0.0, 0.0, pytest.approx(1.2e-38)]
    assert (checkpoint.tensors["layers.0.edge_func.2.weight"] == 0.1).all()
    assert (checkpoint.tensors["layers.5.edge_func.4.bias"] == -5.2).all()
    assert load_scorer("published").name == "published"


def test_wheels_and_either_folder_are_understood(tmp_path, cache):
    site_packages = unpacked(tmp_path / "site-packages", published_state())
    content = (site_packages / STATE_FILE).read_bytes()
    import_published(wheel(tmp_path / "p.whl", STATE_FILE, content))
    shutil.rmtree(cache)
    assert import_published(site_packages / "socnavgym").is_dir()


class Explosive:
    def __reduce__(self):
        return (open, ("exploded", "w"))


@pytest.mark.parametrize("save", [torch.save, lambda value, path: path.write_bytes(pickle.dumps(value))])
def test_code_in_the_file_is_not_run(tmp_path, cache, monkeypatch, save):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "package" / STATE_FILE
    path.parent.mkdir(parents=True)
    save({"gnn_object.layers.0.bias": Explosive()}, path)
    with pytest.raises(PublishedWeightsError, match=r"SOCNAV_V2\.tch: must be a PyTorch file of tensors: "):
        import_published(tmp_path / "package")
    assert not (tmp_path / "exploded").exists()
    assert not cache.exists()


def changed(**changes):
    state = published_state()
    for name, tensor in changes.items():
        state[f"gnn_object.{name.replace('__', '.')}"] = tensor
    return state


def without(name):
    state = published_state()
    del state[name]
    return state


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: without("gnn_object.layers.2.bias"),
            "tensor gnn_object.layers.2.bias is missing, sizes 42-40-30-21-12-3-2",
        ),
        (
            lambda: changed(extra=torch.zeros(1)),
            "tensor gnn_object.extra is not part of the published network, sizes 42-40-30-21-12-3-2",
        ),
        (
            lambda: changed(layers__0__bias=torch.zeros(31)),
            "tensor gnn_object.layers.0.bias must be float32 of shape 30, got float32 of 31",
        ),
        (
            lambda: changed(layers__0__bias=torch.zeros(30, dtype=torch.float64)),
            "tensor gnn_object.layers.0.bias must be float32 of shape 30, got float64 of 30",
        ),
        (
            lambda: changed(layers__0__bias=torch.full((30,), torch.nan)),
            "tensor gnn_object.layers.0.bias must hold finite numbers only",
        ),
        (lambda: {"epoch": 3}, "must hold named tensors and nothing else"),
    ],
)
def test_other_networks_are_refused(tmp_path, cache, make, message):
    with pytest.raises(PublishedWeightsError) as caught:
        import_published(unpacked(tmp_path, make()))
    assert str(caught.value) == f"{tmp_path / STATE_FILE}: {message}"
    assert not cache.exists()


def test_sources_without_the_weights_are_named(tmp_path, cache):
    with pytest.raises(PublishedWeightsError, match=r"must be a folder with socnavgym/envs.*missing$"):
        import_published(tmp_path)
    with pytest.raises(PublishedWeightsError, match=r"p\.whl: must be a wheel with socnavgym/envs"):
        import_published(wheel(tmp_path / "p.whl", "other.txt", b""))
    (tmp_path / "text.whl").write_text("text")
    with pytest.raises(PublishedWeightsError, match=r"text\.whl: must be a wheel, which is a zip file"):
        import_published(tmp_path / "text.whl")


@pytest.mark.parametrize("source", ["numpy", "absent.whl", "--pre", "socnavgym @ file:///x", "socnavgym==1 -r x"])
def test_pip_downloads_only_the_package_itself(cache, monkeypatch, source):
    monkeypatch.setattr("subprocess.run", lambda *_, **__: pytest.fail("pip was run"))
    with pytest.raises(PublishedWeightsError, match=r"^source must be an existing wheel or folder"):
        import_published(source)


def test_a_failing_pip_is_reported_in_one_line(cache, monkeypatch):
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    with pytest.raises(PublishedWeightsError) as caught:
        import_published("socnavgym==0.1.1")
    assert str(caught.value).startswith("pip could not download socnavgym==0.1.1 (")
    assert "\n" not in str(caught.value)


def test_a_python_without_pip_is_reported(cache, monkeypatch, tmp_path):
    python = tmp_path / "python"
    python.write_text('#!/bin/sh\necho "$0: No module named pip" >&2\nexit 1\n')
    python.chmod(0o755)
    monkeypatch.setattr("sys.executable", str(python))
    with pytest.raises(PublishedWeightsError, match=r"\(.*No module named pip\); fetch its wheel by other means"):
        import_published("socnavgym==0.1.1")


def test_an_unwritable_cache_is_reported(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("SOCNAV_CACHE", str(tmp_path / "file"))
    with pytest.raises(PublishedWeightsError, match=r"cannot write the weights there .* SOCNAV_CACHE"):
        import_published(unpacked(tmp_path, published_state()))
