import shutil
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from reward_model.data.cache import CacheError, StoredWindows, cached_examples, load_examples, store_examples
from reward_model.data.examples import Examples, examples_of
from reward_model.graph.frame import FrameGraph
from reward_model.networks.padded_windows import pack_windows
from reward_model.scenes.scene import LabelledSequence
from tests.reward_model.data.test_examples import labelled
from tests.reward_model.random_scenes import random_sequence


def some_examples() -> Examples:
    return examples_of([labelled(scene, rater) for scene in "123" for rater in "ab"], "mirror")


@pytest.fixture
def entry(tmp_path):
    store_examples(some_examples(), tmp_path / "graphs" / "entry")
    return tmp_path / "graphs" / "entry"


def assert_same_frames(first: list[FrameGraph], second: list[FrameGraph]):
    assert len(first) == len(second)
    for one, other in zip(first, second, strict=True):
        for name, array in one.arrays._asdict().items():
            np.testing.assert_array_equal(array, getattr(other.arrays, name))
            assert array.dtype == getattr(other.arrays, name).dtype


def test_what_was_stored_is_loaded(entry):
    loaded, stored = load_examples(entry), some_examples()
    assert len(loaded.windows) == len(stored.windows) == 12
    for one, other in zip(loaded.windows, stored.windows, strict=True):
        assert_same_frames(one, other)
    np.testing.assert_array_equal(loaded.scores, stored.scores)
    np.testing.assert_array_equal(loaded.variants, stored.variants)
    assert (loaded.scenes, loaded.clips, loaded.raters) == (stored.scenes, stored.clips, stored.raters)
    assert [path.name for path in entry.parent.iterdir()] == ["entry"]


def test_frames_that_windows_share_are_stored_once(tmp_path):
    windows = [list(window) for window in some_examples().windows[:2]]
    windows[1][0] = windows[0][1]
    shared = replace(some_examples().chosen([0, 1]), windows=windows)
    store_examples(shared, tmp_path / "entry")
    assert len(np.load(tmp_path / "entry" / "node_starts.npy")) == 3 + 1
    for one, other in zip(load_examples(tmp_path / "entry").windows, windows, strict=True):
        assert_same_frames(one, other)


def test_scenes_without_any_link(tmp_path):
    nobody = random_sequence(np.random.default_rng(0), 1, 0, 1)
    store_examples(examples_of([LabelledSequence(nobody, 0.5, None, "1")]), tmp_path / "entry")
    assert len(load_examples(tmp_path / "entry").windows[0][0].arrays.link_lengths) == 0


def test_windows_behave_like_a_list(entry):
    windows = load_examples(entry).windows
    assert isinstance(windows, StoredWindows)
    assert_same_frames(windows[-1], windows[11])
    assert [len(window) for window in windows[8::3]] == [2, 2]
    with pytest.raises(IndexError):
        windows[12]
    batch, expected = pack_windows(windows[:3]), pack_windows(some_examples().windows[:3])
    assert batch.features.equal(expected.features)


def test_windows_are_mapped_not_read(entry):
    features = load_examples(entry).windows[0][0].arrays.features
    assert isinstance(features.base, np.memmap)
    features[:] = 0  # stays in this process
    assert load_examples(entry).windows[0][0].arrays.features.any()


@pytest.mark.parametrize("name", ["features.npy", "node_starts.npy", "scores.npy", "names.json", "index.json"])
@pytest.mark.parametrize("damage", ["missing", "short", "empty", "changed"])
def test_damage_is_reported_in_one_line(entry, name, damage):
    path = entry / name
    content = path.read_bytes()
    changed = content[:-3] + bytes(byte ^ 1 for byte in content[-3:])
    path.unlink()
    if damage != "missing":
        path.write_bytes({"short": content[: len(content) // 2], "empty": b"", "changed": changed}[damage])
    with pytest.raises(CacheError) as caught:
        load_examples(entry)
    message = str(caught.value)
    assert message.startswith(f"{entry}: this entry of the cache is damaged (")
    assert message.endswith("; delete the folder") and "\n" not in message


def test_an_entry_depends_on_content_and_augmentation(tmp_path):
    files = tuple(tmp_path / name for name in ("a.json", "b.json"))
    for path in files:
        path.write_text(path.name)
    made = []

    def make():
        made.append(1)
        return some_examples()

    def calls(paths=files, augmentation="none") -> int:
        cached_examples(paths, augmentation, tmp_path / "graphs", make)
        return len(made)

    assert [calls(), calls(), calls(augmentation="mirror"), calls(), calls(files[::-1])] == [1, 1, 2, 2, 3]
    shutil.move(files[0], tmp_path / "c.json")
    assert calls((tmp_path / "c.json", files[1])) == 3
    files[1].write_text("B")
    assert calls((tmp_path / "c.json", files[1])) == 4


def store_many_times(entry: Path) -> None:
    examples = some_examples()
    for index in range(20):
        store_examples(examples, entry.parent / f"{index}")


def test_two_processes_may_write_at_once(tmp_path):
    context = get_context("spawn")
    processes = [context.Process(target=store_many_times, args=(tmp_path / "entry",)) for _ in range(2)]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
    assert [process.exitcode for process in processes] == [0, 0]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(map(str, range(20)))
    for path in tmp_path.iterdir():
        assert len(load_examples(path)) == 12
