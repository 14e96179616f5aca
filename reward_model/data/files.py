"""Files of labelled scenes: SocNav1's JSON lines, folders of SocNav2 recordings, lists of their names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Final, Literal

import joblib

from reward_model.data.augmentation import judged_window
from reward_model.data.examples import PARTS, DatasetError, Part
from reward_model.scenes.json_fields import read_text_file
from reward_model.scenes.scene import LabelledSequence, ScenarioError, SceneSequence
from reward_model.scenes.socnav1 import read_socnav1
from reward_model.scenes.socnav2_json import read_labelled_socnav2

SPLIT_LISTS: Final = MappingProxyType[Part, str](
    {"train": "train_set.txt", "development": "dev_set.txt", "test": "test_set.txt"}
)
RATING_FILES: Final = MappingProxyType[Part, str](
    {"train": "train.jsonl", "development": "dev.jsonl", "test": "test.jsonl"}
)
DataFiles = dict[Part | Literal["all"], tuple[Path, ...]]
Needed = Callable[[SceneSequence], SceneSequence]
MANIFEST: Final = "manifest.json"  # beside simulated recordings, with the options that made them
_MANY: Final = 1000  # files, from which on several processes save more time than their start takes
_TOGETHER: Final = 50  # files that a process reads at a time
_MOST_PROBLEMS: Final = 20  # lines of one error message at most


def find_files(path: Path) -> DataFiles:
    """The files of a data set by part, or under `all` where they are not split.

    Args:
        path: a `.jsonl` file of SocNav1 ratings, a `.json` recording, a `.txt` list of recordings (one name a line,
            relative to the list), or a folder: with the lists of `SPLIT_LISTS`, with the files of `RATING_FILES`, or
            with recordings or ratings that are not split

    Raises:
        DatasetError: If no file is found, or a list names a missing file or one file twice.
    """
    if path.is_dir():
        return _find_in_folder(path)
    if not path.is_file():
        raise DatasetError(f"{path}: data must be an existing file or folder")
    if path.suffix == ".txt":
        return {"all": _listed(path)}
    if path.suffix in (".json", ".jsonl"):
        return {"all": (path,)}
    raise DatasetError(f"{path}: data must be a .jsonl, .json or .txt file or a folder")


def read_files(
    files: tuple[Path, ...], after_file: Callable[[], None] = lambda: None, needed: Needed = judged_window
) -> Iterator[LabelledSequence]:
    """Read labelled scenes, file by file; `needed` reduces recordings, by default to the window that is scored.

    Many files are read by as many processes as the machine has cores (or as `LOKY_MAX_CPU_COUNT` sets).
    Reading continues after a broken file, so that at the end one `ScenarioError` names them all, a line each.
    """
    problems = []
    for found in _each_read(files, needed):
        if isinstance(found, str):
            problems.append(found)
        else:
            yield from found
        after_file()
    if problems:
        more = len(problems) - _MOST_PROBLEMS
        rest = [f"and {more} more files"] if more > 0 else []
        raise ScenarioError("\n".join(problems[:_MOST_PROBLEMS] + rest))


def _each_read(files: tuple[Path, ...], needed: Needed) -> Iterator[list[LabelledSequence] | str]:
    """The content of each file, in their order, or its error message."""
    if len(files) < _MANY:
        yield from (_read_file(path, needed) for path in files)
        return
    chunks = [files[start : start + _TOGETHER] for start in range(0, len(files), _TOGETHER)]
    read = joblib.delayed(_read_chunk)
    for part in joblib.Parallel(n_jobs=-1, return_as="generator")(read(each, needed) for each in chunks):
        yield from part


def _read_chunk(files: tuple[Path, ...], needed: Needed) -> list[list[LabelledSequence] | str]:
    return [_read_file(path, needed) for path in files]


def _read_file(path: Path, needed: Needed) -> list[LabelledSequence] | str:
    try:
        if path.suffix == ".jsonl":
            return read_socnav1(path)
        recording = read_labelled_socnav2(path)
    except ScenarioError as error:
        return str(error)
    return [replace(recording, sequence=needed(recording.sequence))]


def _find_in_folder(folder: Path) -> DataFiles:
    found: DataFiles = {}
    for part in PARTS:
        split_list, ratings = folder / SPLIT_LISTS[part], folder / RATING_FILES[part]
        if split_list.is_file():
            found[part] = _listed(split_list)
        elif ratings.is_file():
            found[part] = (ratings,)
    if found:
        return found
    found_files = (*folder.glob("*.json"), *folder.glob("*.jsonl"))
    loose = tuple(sorted(path for path in found_files if path.name != MANIFEST))
    if not loose:
        raise DatasetError(f"{folder}: must hold recordings (*.json), ratings (*.jsonl) or split lists, found none")
    return {"all": loose}


def _listed(path: Path) -> tuple[Path, ...]:
    names = [line.strip() for line in read_text_file(path).splitlines() if line.strip()]
    if not names:
        raise DatasetError(f"{path}: must name at least one file, one a line, got none")
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise DatasetError(f"{path}: must name each file once, {twice[0]} is there {names.count(twice[0])} times")
    missing = [name for name in names if not (path.parent / name).is_file()]
    if missing:
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        raise DatasetError(f"{path}: names {missing[0]}{more}, which {path.parent} does not hold")
    return tuple(path.parent / name for name in names)
