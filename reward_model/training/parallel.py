"""Many trainings in parallel, each in a folder of its own, so that none is lost and none is done twice.

The folder has the state of a running session and the result of a finished one. The process that runs a session holds
its lock: after a crash the session is resumed, and a process that outlived its parent is waited for.
"""

from __future__ import annotations

import importlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final, Literal

import joblib
import torch
from filelock import FileLock

from reward_model.base.files import replace_file
from reward_model.base.progress import progress_bars
from reward_model.data.loading import load_parts
from reward_model.training.fit import DivergedError
from reward_model.training.session import STATE_FILE, Session, learn

Backend = Literal["loky", "ray"]
RESULT_FILE: Final = "result.json"
FAILED: Final = "failed"  # key of the error message in the result of a failed training
_LOCK_FILE: Final = ".lock"


def run_sessions(
    sessions: Mapping[str, Session], folder: Path, jobs: int = 1, backend: Backend = "loky"
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Run sessions in folders of their names, `jobs` at a time; yields names and results in order of completion.

    Interrupted sessions are resumed, finished ones are read. A result is the checkpoint's `about`; that of a diverged
    training has the key `FAILED`.

    Raises:
        ValueError: If the backend is not installed, and what `load_parts` and `fit` raise.
    """
    if jobs < 1:
        raise ValueError(f"jobs must be at least 1, got {jobs}")
    order: Literal["generator_unordered", "list"] = "generator_unordered"
    if backend == "ray":
        _register_ray()
        order = "list"  # Ray's backend returns results when all are ready; their folders have them before
    with joblib.parallel_config(backend=backend, n_jobs=jobs):
        yield from joblib.Parallel(return_as=order, pre_dispatch="n_jobs")(
            joblib.delayed(_named)(name, session, folder / name) for name, session in sessions.items()
        )


def run_session(session: Session, folder: Path) -> dict[str, Any]:
    """Run one session, or read its result; see `run_sessions`."""
    result_file, state_file = folder / RESULT_FILE, folder / STATE_FILE
    folder.mkdir(parents=True, exist_ok=True)
    with FileLock(folder / _LOCK_FILE):
        if not result_file.exists():
            result = _learned(session, folder, state_file.exists())
            replace_file(result_file, (json.dumps(result, indent=2) + "\n").encode())
        state_file.unlink(missing_ok=True)
    return read_result(folder)


def read_result(folder: Path) -> dict[str, Any]:
    """The result of a finished session. Raises `ValueError` where it cannot be read."""
    path = folder / RESULT_FILE
    try:
        result: dict[str, Any] = json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise ValueError(
            f"{path}: must hold the result of a session; delete {folder} to run it anew ({error})"
        ) from None
    return result


def _named(name: str, session: Session, folder: Path) -> tuple[str, dict[str, Any]]:
    return name, run_session(session, folder)


def _learned(session: Session, folder: Path, resume: bool) -> dict[str, Any]:
    threads = torch.get_num_threads()
    torch.set_num_threads(1)  # sums depend on the number of threads; results must not depend on that of jobs
    try:
        with progress_bars(shown=False) as progress:
            parts = load_parts(session.data, progress)
        return learn(session, parts, folder, resume=resume)
    except DivergedError as error:
        return {FAILED: str(error)}
    finally:
        torch.set_num_threads(threads)


def _register_ray() -> None:
    try:
        importlib.import_module("ray.util.joblib").register_ray()
    except ImportError as error:
        raise ValueError(f'backend ray needs Ray: pip install "socnav2[ray]" ({error})') from None
