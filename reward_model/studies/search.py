"""Random search over hyperparameters, after Bachiller et al. 2021: an Optuna study of any number of sessions.

A session's hyperparameters follow from the search's seed and the session's number, whatever runs beside it. The study
(`study.db`, SQLite) is written by one process alone; sessions run in folders of their own (see
`reward_model.training.parallel`), so that after a crash those that were running are taken up where they were.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import optuna
from filelock import FileLock, Timeout
from optuna.trial import FrozenTrial, TrialState, create_trial
from sqlalchemy.exc import SQLAlchemyError

from reward_model.base.progress import progress_bars
from reward_model.data.examples import DatasetError
from reward_model.data.labelled_windows import data_digest
from reward_model.data.loading import DataConfig, load_parts
from reward_model.networks.building import usable_device
from reward_model.networks.checkpoint import WEIGHTS_FILE
from reward_model.studies.search_report import Finished, write_reports
from reward_model.studies.search_space import SearchSpace
from reward_model.training.parallel import FAILED, Backend, read_result, run_sessions
from reward_model.training.session import Session
from reward_model.training.state import check_same

STUDY_FILE: Final = "study.db"
SESSIONS_FOLDER: Final = "sessions"
_STUDY: Final = "search"  # the name of the only study in the file, and of what makes it this one
_LOCK_FILE: Final = ".lock"


@dataclass(frozen=True)
class SearchConfig:
    """How much to search, and with what.

    Attributes:
        sessions: in all, those of a search that is gone on with included
        seed: of the hyperparameters; a session's weights and the order of its data follow from its number
        clips_alike: as in `Session`
    """

    sessions: int = 341
    seed: int = 0
    clips_alike: bool = True
    jobs: int = 1
    backend: Backend = "loky"
    device: str = "cpu"

    def __post_init__(self) -> None:
        for name in ("sessions", "jobs"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, got {getattr(self, name)}")


def search(
    data: DataConfig, space: SearchSpace, config: SearchConfig, output: Path, resume: bool = False
) -> list[Finished]:
    """Run the sessions that are still to be run; all that are over, by number.

    After each of them the tables in `output` are written anew, and of every block the best network alone is kept.
    Raises `ValueError`s for what is wrong with data or options, `TrainingStateError` where the study in `output` is
    one of another space, seed or data, and `OSError` where it cannot be read or written.
    """
    path = output / STUDY_FILE
    if path.exists() and not resume:
        raise DatasetError(f"{output}: holds a search already; resume it or choose another output")
    if resume and not path.exists():
        raise DatasetError(f"{output}: there is no search to go on with; start one without resume")
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    identity = _identity(data, space, config)
    for number in range(min(config.sessions, len(space.blocks))):
        usable_device(space.network(space.draw(config.seed, number).params), config.device)
    output.mkdir(parents=True, exist_ok=True)
    with _alone(output), _one_line_errors(path), _study(path) as study:
        begun: dict[str, Any] = study.user_attrs.get(_STUDY, identity)
        # Options of networks that are not searched among are no part of a study; older ones have them.
        searched = {name: begun[name] for name in begun if name in identity or name not in vars(space)}
        check_same(path, searched, identity, "a study")
        study.set_user_attr(_STUDY, identity)
        for number in range(len(study.trials), config.sessions):
            params, distributions = space.draw(config.seed, number)
            study.add_trial(create_trial(state=TrialState.RUNNING, params=params, distributions=distributions))
        return _run(study, lambda trial: _session(data, space, config, trial), config, output)


def _identity(data: DataConfig, space: SearchSpace, config: SearchConfig) -> dict[str, Any]:
    """What makes this search this one."""
    with progress_bars() as progress:
        parts = load_parts(data, progress)
    digests = {f"{part}_data": data_digest(examples.labelled()) for part, examples in parts.items()}
    identity = {**space.document(), **digests, "seed": config.seed, "clips_alike": config.clips_alike}
    plain: dict[str, Any] = json.loads(json.dumps(identity))
    return plain


def _session(data: DataConfig, space: SearchSpace, config: SearchConfig, trial: FrozenTrial) -> Session:
    training = space.training(trial.params, trial.number, config.device)
    return Session(data, space.network(trial.params), training, config.clips_alike)


def _run(
    study: optuna.Study, session_of: Callable[[FrozenTrial], Session], config: SearchConfig, output: Path
) -> list[Finished]:
    folder = output / SESSIONS_FOLDER
    waiting = {_name(trial): trial for trial in study.trials if trial.state == TrialState.RUNNING}
    running = run_sessions(
        {name: session_of(trial) for name, trial in waiting.items()}, folder, config.jobs, config.backend
    )
    with progress_bars(kept=True) as progress:
        bar = progress.add_task("search", total=len(study.trials), completed=len(study.trials) - len(waiting))
        for name, result in running:
            number = waiting[name].number
            if FAILED in result:
                study.tell(number, state=TrialState.FAIL)
            else:
                study.tell(number, result["development_error"])
            progress.advance(bar)
            _tidy(_report(study, output), folder)
    return _report(study, output)


def _report(study: optuna.Study, output: Path) -> list[Finished]:
    over = [trial for trial in study.trials if trial.state != TrialState.RUNNING]
    rows = [
        Finished(trial.number, trial.params, read_result(output / SESSIONS_FOLDER / _name(trial))) for trial in over
    ]
    write_reports(rows, output)
    return rows


def _tidy(rows: list[Finished], folder: Path) -> None:
    """Hundreds of networks take gigabytes: keep the weights of each block's best."""
    best: dict[str, Finished] = {}
    for row in rows:
        block = row.params["block"]
        if FAILED not in row.result and (block not in best or row.development < best[block].development):
            best[block] = row
    kept = {row.number for row in best.values()}
    for row in rows:
        if row.number not in kept:
            (folder / f"{row.number:04}" / WEIGHTS_FILE).unlink(missing_ok=True)


def _name(trial: FrozenTrial) -> str:
    return f"{trial.number:04}"


@contextlib.contextmanager
def _alone(output: Path) -> Iterator[None]:
    try:
        with FileLock(output / _LOCK_FILE, timeout=0):
            yield
    except Timeout:
        raise DatasetError(f"{output}: another search is running in this folder; wait for its end") from None


@contextlib.contextmanager
def _study(path: Path) -> Iterator[optuna.Study]:
    storage = optuna.storages.RDBStorage(f"sqlite:///{path}")
    try:
        yield optuna.create_study(
            study_name=_STUDY, storage=storage, sampler=optuna.samplers.RandomSampler(seed=0), load_if_exists=True
        )
    finally:
        storage.engine.dispose()


@contextlib.contextmanager
def _one_line_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except (SQLAlchemyError, optuna.exceptions.StorageInternalError) as error:
        reason = str(error.__cause__ or error).splitlines()[0]
        raise OSError(f"{path}: the study cannot be read or written ({reason})") from None
