"""The cache of examples on disk, so that a data set is converted to graphs only once.

An entry is a folder named by a hash of all that it depends on: the content of the files, the augmentation and the
graph layout. Its arrays are memory-mapped, so that loading takes no longer than checking them. Entries are written
under a temporary name and renamed: an entry is complete or absent, and where two processes write the same one, the
first is kept.
"""

from __future__ import annotations

import hashlib
import json
import tempfile
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, overload

import numpy as np
from numpy.typing import NDArray

from reward_model.data.examples import Examples
from reward_model.graph.features import LAYOUT_VERSION
from reward_model.graph.frame import FrameGraph

_VERSION: Final = "socnav2-examples-3"  # changed with the way files are read and with an entry's arrays
_INDEX_FILE: Final = "index.json"
_NAMES_FILE: Final = "names.json"
_OF_NODES: Final = ("features", "kinds", "keys", "lengths")
_OF_LINKS: Final = ("link_sources", "link_targets", "link_relations", "link_lengths")
_NAMES: Final = ("scenes", "clips", "raters")

Arrays = dict[str, NDArray[Any]]


class CacheError(ValueError):
    """An entry of the cache is damaged. The message names it and the remedy."""


class StoredWindows(Sequence[list[FrameGraph]]):
    """Windows as slices of a few long arrays; a window's frames are made on access.

    Args:
        arrays: those of `FrameGraph`, one frame after the other; the first node and the first link of each frame,
            `node_starts` and `link_starts`; the frames of all windows, `window_frames`, and the first of each window,
            `window_starts`. Windows may share frames
    """

    def __init__(self, arrays: Arrays) -> None:
        self._arrays = arrays

    def __len__(self) -> int:
        return len(self._arrays["window_starts"]) - 1

    @overload
    def __getitem__(self, index: int) -> list[FrameGraph]: ...
    @overload
    def __getitem__(self, index: slice) -> list[list[FrameGraph]]: ...
    def __getitem__(self, index: int | slice) -> list[FrameGraph] | list[list[FrameGraph]]:
        if isinstance(index, slice):
            return [self[each] for each in range(*index.indices(len(self)))]
        first, last = self._arrays["window_starts"][range(len(self))[index] :][:2].tolist()
        return [self._frame(frame) for frame in self._arrays["window_frames"][first:last].tolist()]

    def _frame(self, index: int) -> FrameGraph:
        nodes = slice(*self._arrays["node_starts"][index : index + 2].tolist())
        links = slice(*self._arrays["link_starts"][index : index + 2].tolist())
        arrays = {name: self._arrays[name][nodes] for name in _OF_NODES}
        arrays |= {name: self._arrays[name][links] for name in _OF_LINKS}
        return FrameGraph(**arrays, surroundings=self._arrays["surroundings"][index])


def cached_examples(files: tuple[Path, ...], variety: str, folder: Path, make: Callable[[], Examples]) -> Examples:
    """The examples of some files, from the cache; where it has none, from `make`, and then stored.

    Args:
        variety: name of the augmentation, and of all else that makes other examples of the same files

    Raises:
        CacheError: If the entry is damaged.
    """
    entry = folder / _key(files, variety)
    if not entry.is_dir():
        examples = make()
        store_examples(examples, entry)
        return examples
    return load_examples(entry)


def store_examples(examples: Examples, entry: Path) -> None:
    """Write an entry unless it exists. Raises `OSError` where it cannot be written."""
    try:
        entry.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{entry.name}.", dir=entry.parent) as place:
            building = Path(place) / entry.name
            building.mkdir()
            _write_arrays(examples, building)
            try:
                building.rename(entry)
            except OSError:
                if not entry.is_dir():  # else another process was first
                    raise
    except OSError as error:
        raise OSError(f"{entry}: the graphs cannot be kept ({error}); make room, or --no-cache does without") from None


def _write_arrays(examples: Examples, building: Path) -> None:
    names = json.dumps({name: getattr(examples, name) for name in _NAMES}).encode()
    checksums = {_NAMES_FILE: zlib.crc32(names)}
    (building / _NAMES_FILE).write_bytes(names)
    for name, array in _flattened(examples).items():
        np.save(building / f"{name}.npy", array, allow_pickle=False)
        checksums[f"{name}.npy"] = _checksum(array)
    (building / _INDEX_FILE).write_text(json.dumps({"version": _VERSION, "checksums": checksums}))


def load_examples(entry: Path) -> Examples:
    """Load an entry: its arrays are mapped into memory and checked. Raises `CacheError` where it is damaged."""
    try:
        index = json.loads((entry / _INDEX_FILE).read_text())
        names = (entry / _NAMES_FILE).read_bytes()
        found = {_NAMES_FILE: zlib.crc32(names)}
        arrays: Arrays = {}
        for name in index["checksums"].keys() - found.keys():
            # Copy-on-write, never written: read-only arrays would be another type to compiled code.
            array = np.load(entry / name, mmap_mode="c", allow_pickle=False)
            arrays[name.removesuffix(".npy")], found[name] = array, _checksum(array)
        damaged = sorted(name for name, checksum in index["checksums"].items() if found[name] != checksum)
        if damaged or index["version"] != _VERSION:
            raise ValueError(f"checksum of {damaged[0]} is wrong" if damaged else "another version")
        scenes, clips, raters = (tuple(json.loads(names)[name]) for name in _NAMES)
        return Examples(StoredWindows(arrays), arrays["scores"], scenes, clips, raters, arrays["variants"])
    except (OSError, ValueError, KeyError, TypeError, EOFError) as error:
        raise CacheError(f"{entry}: this entry of the cache is damaged ({error}); delete the folder") from None


def _key(files: tuple[Path, ...], variety: str) -> str:
    digest = hashlib.sha256(f"{_VERSION} {LAYOUT_VERSION} {variety}".encode())
    for path in files:
        with path.open("rb") as file:
            digest.update(path.suffix.encode() + hashlib.file_digest(file, "sha256").digest())
    return digest.hexdigest()[:32]


def _flattened(examples: Examples) -> Arrays:
    windows = list(examples.windows)
    places: dict[FrameGraph, int] = {}  # frames compare by identity
    window_frames = [places.setdefault(frame, len(places)) for window in windows for frame in window]
    frames = list(places)
    arrays: Arrays = {
        name: np.concatenate([getattr(frame.arrays, name) for frame in frames]) for name in (*_OF_NODES, *_OF_LINKS)
    }
    arrays["surroundings"] = np.array([frame.arrays.surroundings for frame in frames])
    arrays["node_starts"] = _starts([len(frame) for frame in frames])
    arrays["link_starts"] = _starts([frame.num_links for frame in frames])
    arrays["window_frames"] = np.array(window_frames, dtype=np.int64)
    arrays["window_starts"] = _starts([len(window) for window in windows])
    return arrays | {"scores": examples.scores, "variants": examples.variants}


def _starts(lengths: list[int]) -> NDArray[np.int64]:
    return np.concatenate([[0], np.cumsum(lengths, dtype=np.int64)])


def _checksum(array: NDArray[Any]) -> int:
    shape = f"{array.dtype.str}{array.shape}".encode()
    return zlib.crc32(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data, zlib.crc32(shape))
