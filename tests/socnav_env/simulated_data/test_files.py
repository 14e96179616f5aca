"""Folders of simulated sequences: the same for any number of processes, and whole whatever happens."""

from __future__ import annotations

import errno
import json
import os
import signal
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from reward_model.scenes.socnav2_json import read_socnav2
from socnav_env.commands.main import main
from socnav_env.simulated_data import files as dataset_generation
from socnav_env.simulated_data.files import GenerationError, generate_sequences
from socnav_env.simulated_data.sequences import DRIVER_SHARES, plan_sequence, simulate_sequence


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("generated")
    assert generate_sequences(folder, 5, seed=3) == 5
    return folder


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_sequences_look_like_genuine_ones(folder: Path) -> None:
    for number in range(5):
        sequence = read_socnav2(folder / f"sequence-{number:06}.json")
        times = [snapshot.timestamp for snapshot in sequence]
        assert (len(sequence), times[0], times[-1]) == (35, 0.0, 4.0)
        assert set(np.diff(times).round(6)) == {0.1, 0.2}
        document = json.loads((folder / f"sequence-{number:06}.json").read_text())
        assert all("interval" not in snapshot for snapshot in document)  # nothing that the format does not know
        assert not any(person["vx"] or person["vy"] for person in document[0]["people"])
        here, before = document[20]["people"], document[19]["people"]
        for now, earlier in zip(here, before, strict=True):
            assert now["vx"] == pytest.approx(earlier["x"] - now["x"], abs=1e-9)
            assert now["vy"] == pytest.approx(earlier["y"] - now["y"], abs=1e-9)
        commands = np.array([snapshot["command"] for snapshot in document])
        assert np.abs(commands[:, 0]).max() <= 3.5 + 1e-9
        assert np.abs(commands[:, 2]).max() <= 4.0 + 1e-9


def test_the_manifest_says_how_they_were_made(folder: Path) -> None:
    manifest = json.loads((folder / "manifest.json").read_text())
    assert (manifest["seed"], manifest["snapshots"], manifest["drivers"]) == (3, 35, dict(DRIVER_SHARES))
    assert manifest["config"]["control_period"] == 0.1
    assert set(manifest["versions"]) == {"simulation", "numba", "numpy", "pymunk"}
    files = [each["file"] for each in manifest["sequences"]]
    assert sorted([*files, "manifest.json"]) == sorted(path.name for path in folder.iterdir())
    assert [each["driver"] for each in manifest["sequences"]] == [plan_sequence(3, index).driver for index in range(5)]


def test_drivers_take_turns_as_often_as_they_shall() -> None:
    counted = Counter(plan_sequence(0, index).driver for index in range(2000))
    for driver, share in DRIVER_SHARES.items():
        assert counted[driver] / 2000 == pytest.approx(share, abs=0.03)


def test_any_number_of_processes_writes_the_same(folder: Path, tmp_path: Path) -> None:
    generate_sequences(tmp_path, 5, seed=3, jobs=2)
    assert contents(tmp_path) == contents(folder)


def test_a_run_that_was_broken_off_is_completed(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    generate_sequences(tmp_path, 3, seed=3)
    (tmp_path / "sequence-000001.json").unlink()
    assert main(["generate", "--num-sequences", "5", "--output", str(tmp_path), "--seed", "3", "--jobs", "1"]) == 0
    assert capsys.readouterr().out == f"{tmp_path}: 3 new sequences, 5 in all\n"
    assert contents(tmp_path) == contents(folder)
    assert generate_sequences(tmp_path, 2, seed=3) == 0
    assert contents(tmp_path) == contents(folder)  # fewer are there already


def test_a_full_disk_leaves_what_is_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    genuine = dataset_generation.replace_file

    def full(path: Path, content: bytes) -> None:
        if path.name == "sequence-000002.json":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        genuine(path, content)

    monkeypatch.setattr(dataset_generation, "replace_file", full)
    assert main(["generate", "--num-sequences", "4", "--output", str(tmp_path), "--jobs", "1"]) == 1
    error = capsys.readouterr().err
    assert error == (
        f"socnav_env: {tmp_path / 'sequence-000002.json'}: cannot write it: No space left on device; "
        "what is finished stays, run the same command again for the rest\n"
    )
    assert sorted(contents(tmp_path)) == ["manifest.json", "sequence-000000.json", "sequence-000001.json"]
    monkeypatch.undo()
    assert generate_sequences(tmp_path, 4, seed=0) == 2


def _die(seed: int, index: int) -> bytes:
    os.kill(os.getpid(), signal.SIGKILL)
    return b""


def test_a_killed_process_is_said_in_a_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dataset_generation, "_document", _die)
    with pytest.raises(GenerationError, match=r"a process was killed, .* run the same command again for the rest"):
        generate_sequences(tmp_path, 4, seed=0, jobs=2)
    assert list(contents(tmp_path)) == ["manifest.json"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--num-sequences", "5", "--seed", "4"], "made with another seed, 3 and not 4; choose another folder"),
        (["--num-sequences", "0"], "num_sequences must be at least 1, got 0"),
        (["--num-sequences", "5", "--seed", "3", "--backend", "dask"], "backend must be one of loky, ray, got 'dask'"),
        (["--num-sequences", "5", "--seed", "3", "--address", "x"], "address needs backend ray, got 'x' with loky"),
    ],
)
def test_bad_input_is_answered_with_one_line(
    folder: Path, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["generate", "--output", str(folder), *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("file", "text", "message"),
    [
        ("sequence-000007.json", "[]", "holds sequences without a manifest.json; choose another folder"),
        ("manifest.json", "{", "must be a manifest of simulated sequences; choose another folder"),
    ],
)
def test_folders_of_unknown_origin_are_left_alone(tmp_path: Path, file: str, text: str, message: str) -> None:
    (tmp_path / file).write_text(text)
    with pytest.raises(ValueError, match=message):
        generate_sequences(tmp_path, 1, seed=0)
    assert contents(tmp_path) == {file: text.encode()}


def test_without_ray_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(ValueError, match=r'backend ray needs Ray: pip install "socnav2\[ray\]"'):
        generate_sequences(tmp_path, 2, seed=0, backend="ray")


@pytest.mark.slow
def test_a_ray_cluster_writes_the_same(folder: Path, tmp_path: Path) -> None:
    pytest.importorskip("ray")
    generate_sequences(tmp_path, 5, seed=3, jobs=2, backend="ray")
    assert contents(tmp_path) == contents(folder)


def test_a_sequence_is_the_same_whenever_it_is_made() -> None:
    one, again, other = simulate_sequence(0, 7), simulate_sequence(0, 7), simulate_sequence(0, 8)
    np.testing.assert_array_equal(one.last.people.poses, again.last.people.poses)
    assert len(one.last.people) != len(other.last.people) or not np.array_equal(one.last.goal, other.last.goal)
