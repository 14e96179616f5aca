"""Simulated sequences as files, in bulk: a folder of SocNav2 JSON files with a manifest of their origin.

Every file appears complete or not at all, and depends on the seed and its number alone. After a broken-off run, the
next one with the same settings makes the missing files.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import joblib
from joblib.externals.loky.process_executor import BrokenProcessPool

from reward_model.base.files import replace_file
from reward_model.scenes.socnav2_json import encode_socnav2
from socnav_env.simulated_data.sequences import plan_sequence, settings, simulate_sequence
from socnav_env.trajectories.versions import simulation_versions

MANIFEST: Final = "manifest.json"
FORMAT: Final = "socnav2-simulated-sequences"
FORMAT_VERSION: Final = 1
BACKENDS: Final = ("loky", "ray")
ROUND: Final = 16  # sequences per process between two writes


class GenerationError(Exception):
    """A run was broken off; the message gives the reason and says that finished files stay."""


def generate_sequences(
    folder: Path,
    num_sequences: int,
    seed: int,
    jobs: int = 1,
    backend: str = "loky",
    address: str | None = None,
    report: Callable[[int], object] = lambda count: None,
) -> int:
    """Write the missing ones of sequences 0 to `num_sequences` - 1 and return their number.

    Args:
        jobs: number of processes, on which the result does not depend
        backend: joblib's, from `BACKENDS`
        address: of a Ray cluster, None: one on this machine
        report: called with the number of finished sequences, first of earlier runs, then of every round

    Raises:
        ValueError: If the folder holds sequences of other settings or the backend is not installed.
        GenerationError: If a process was killed or a file could not be written.
    """
    manifest = _manifest(num_sequences, seed)
    _take_folder(folder, manifest)
    missing = [index for index in range(num_sequences) if not _file(folder, index).exists()]
    report(num_sequences - len(missing))
    with _parallel(jobs if len(missing) > 1 else 1, backend, address):
        for start in range(0, len(missing), ROUND * jobs):
            numbers = missing[start : start + ROUND * jobs]
            _write(folder, numbers, _simulated(seed, numbers, start))
            report(len(numbers))
    return len(missing)


def _simulated(seed: int, numbers: Sequence[int], finished: int) -> list[bytes]:
    try:
        return list(joblib.Parallel()(joblib.delayed(_document)(seed, number) for number in numbers))
    except BrokenProcessPool:
        raise GenerationError(
            f"a process was killed, perhaps for want of memory; {finished} new sequences are finished, "
            "run the same command again for the rest"
        ) from None


def _document(seed: int, index: int) -> bytes:
    return encode_socnav2(simulate_sequence(seed, index))


def _write(folder: Path, numbers: Sequence[int], documents: Sequence[bytes]) -> None:
    for number, document in zip(numbers, documents, strict=True):
        file = _file(folder, number)
        try:
            replace_file(file, document)
        except OSError as error:
            raise GenerationError(
                f"{file}: cannot write it: {error.strerror or error}; what is finished stays, "
                "run the same command again for the rest"
            ) from None


def _file(folder: Path, index: int) -> Path:
    return folder / f"sequence-{index:06}.json"


def _manifest(num_sequences: int, seed: int) -> dict[str, Any]:
    plans = [plan_sequence(seed, index) for index in range(num_sequences)]
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "seed": seed,
        "versions": simulation_versions(),
        **settings(),
        "sequences": [{"file": _file(Path(), index).name, **asdict(plan)} for index, plan in enumerate(plans)],
    }


def _take_folder(folder: Path, manifest: dict[str, Any]) -> None:
    """Write the manifest; refuse a folder whose sequences have other or unknown settings."""
    path = folder / MANIFEST
    if not path.exists():
        if any(folder.glob("sequence-*.json")):
            raise ValueError(f"{folder}: holds sequences without a {MANIFEST}; choose another folder")
    else:
        known = _read_manifest(path)
        _compare(path, known, manifest)
        if len(known["sequences"]) >= len(manifest["sequences"]):
            return
    replace_file(path, (json.dumps(manifest, indent=1) + "\n").encode())


def _read_manifest(path: Path) -> dict[str, Any]:
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        manifest = None
    if not isinstance(manifest, dict) or not isinstance(manifest.get("sequences"), list):
        raise ValueError(f"{path}: must be a manifest of simulated sequences; choose another folder")
    return manifest


def _compare(path: Path, known: dict[str, Any], manifest: dict[str, Any]) -> None:
    for name, value in json.loads(json.dumps(manifest)).items():
        if name == "sequences" or known.get(name) == value:
            continue
        shown = f", {known.get(name)!r} and not {value!r}" if isinstance(value, int | str) else ""
        raise ValueError(f"{path}: the folder's sequences were made with another {name}{shown}; choose another folder")


@contextlib.contextmanager
def _parallel(jobs: int, backend: str, address: str | None) -> Iterator[None]:
    """Let joblib use a backend, and a cluster if one is named."""
    if backend not in BACKENDS:
        raise ValueError(f"backend must be one of {', '.join(BACKENDS)}, got {backend!r}")
    if backend != "ray":
        if address is not None:
            raise ValueError(f"address needs backend ray, got {address!r} with {backend}")
        with joblib.parallel_config(backend=backend, n_jobs=jobs):
            yield
        return
    try:
        import ray
        from ray.util.joblib import register_ray
    except ImportError:
        raise ValueError('backend ray needs Ray: pip install "socnav2[ray]"') from None
    register_ray()
    started = not ray.is_initialized()
    if started:
        try:
            ray.init(address=address, num_cpus=jobs if address is None else None, log_to_driver=False)
        except ConnectionError as error:
            raise ValueError(f"address: no Ray cluster at {address}: {str(error).splitlines()[0]}") from None
    try:
        with joblib.parallel_config(backend="ray", n_jobs=jobs):
            yield
    finally:
        if started:
            ray.shutdown()
