import io
import json
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from socnav_env.config import EnvConfig
from socnav_env.env import SocNavEnv, action_of
from socnav_env.recording.arrays import LAYOUT_ARRAYS, STATE_ARRAYS, RecordingError
from socnav_env.recording.files import (
    FORMAT_VERSION,
    Recording,
    RecordTrajectory,
    read_recording,
    record_episode,
    write_recording,
)
from socnav_env.simulated_data.drivers import DRIVERS

QUICK = EnvConfig(time_limit=2.0)


def play(env: gym.Env, driver: str, seed: int) -> dict:
    """Play an episode and return its last info."""
    env.reset(seed=seed)
    base, rng = env.unwrapped, np.random.default_rng(seed)
    wheel = DRIVERS[driver](rng)
    while True:
        action = action_of(wheel.command(base.world, rng), base.config.robot)
        *_, terminated, truncated, info = env.step(action)
        if terminated or truncated:
            return info


@pytest.fixture(scope="module")
def recording() -> Recording:
    env = SocNavEnv(reward="sparse", config=QUICK)
    play(env, "goal", seed=6)
    return record_episode(env)


@pytest.fixture
def file(recording: Recording, tmp_path: Path) -> Path:
    path = tmp_path / "episode.npz"
    write_recording(recording, path)
    return path


def rewrite(file: Path, changes: dict | None = None, /, **arrays) -> None:
    """Change a recording behind its writer's back; an array of None is left out."""
    with np.load(file) as archive:
        content = {name: archive[name] for name in archive.files}
    values = json.loads(content["header"].tobytes()) | (changes or {})
    encoded = np.frombuffer(json.dumps(values).encode(), dtype=np.uint8)
    content = {name: array for name, array in (content | {"header": encoded} | arrays).items() if array is not None}
    np.savez(file, **content)


def refusal(file: Path) -> str:
    """What the file is refused with, one line that names it."""
    with pytest.raises(RecordingError) as refused:
        read_recording(file)
    message = str(refused.value)
    assert message.startswith(f"{file}: ")
    assert "\n" not in message
    return message.removeprefix(f"{file}: ")


def test_what_is_read_is_what_was_written(recording: Recording, file: Path) -> None:
    read = read_recording(file)
    assert (read.config, read.scorer, read.versions) == (recording.config, None, recording.versions)
    assert read.random_state == recording.random_state
    one, other = recording.trajectory, read.trajectory
    assert (other.outcome, other.top_speed, other.robot_radius) == (one.outcome, one.top_speed, one.robot_radius)
    assert other.layout.interaction_relations == one.layout.interaction_relations
    for name in STATE_ARRAYS:
        np.testing.assert_array_equal(getattr(other, name), getattr(one, name), strict=True)
    for name in set(LAYOUT_ARRAYS) - {"corners", "start", "people_start"}:
        np.testing.assert_array_equal(getattr(other.layout, name), getattr(one.layout, name), strict=True)
    np.testing.assert_array_equal(other.layout.room.corners, one.layout.room.corners)
    np.testing.assert_array_equal(other.layout.robot_pose, one.layout.robot_pose)
    np.testing.assert_array_equal(other.layout.people_poses, one.layout.people_poses)


def test_the_same_recording_is_the_same_file(recording: Recording, file: Path, tmp_path: Path) -> None:
    write_recording(recording, tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == file.read_bytes()


def test_a_recording_knows_who_scored_it(feature_reward, tmp_path: Path) -> None:
    env = RecordTrajectory(SocNavEnv(reward=feature_reward, config=QUICK), tmp_path)
    info = play(env, "stander", seed=0)
    read = read_recording(tmp_path / "episode-000000.npz")
    assert read.scorer == "features"
    assert tuple(read.trajectory.scores[-1]) == (info["q1"], info["q2"])


def test_a_wrapper_writes_a_file_an_episode_and_goes_on_numbering(tmp_path: Path) -> None:
    for _ in range(2):
        env = RecordTrajectory(gym.make("SocNav2-v0", reward="sparse", config=QUICK), tmp_path / "new", "run")
        play(env, "stander", seed=1)
        env.reset()
        env.step(np.zeros(2))
        env.reset()  # breaks the second episode off, after which nothing has happened yet
        env.close()
    files = sorted(path.name for path in (tmp_path / "new").iterdir())
    assert files == [f"run-{number:06}.npz" for number in range(4)]
    outcomes = [read_recording(tmp_path / "new" / name).trajectory.outcome for name in files]
    assert outcomes == ["timeout", None, "timeout", None]


def test_closing_writes_what_has_happened(tmp_path: Path) -> None:
    env = RecordTrajectory(SocNavEnv(reward="sparse", config=QUICK), tmp_path)
    env.reset(seed=0)
    for _ in range(3):
        env.step(np.zeros(2))
    env.close()
    assert len(read_recording(tmp_path / "episode-000000.npz").trajectory) == 3


def test_the_wrapper_changes_nothing(tmp_path: Path) -> None:
    envs = [SocNavEnv(reward="sparse", config=QUICK), RecordTrajectory(SocNavEnv("sparse", config=QUICK), tmp_path)]
    (one, _), (other, _) = [env.reset(seed=3) for env in envs]
    assert all(np.array_equal(one[name], other[name]) for name in one)
    results = [env.step(np.array([0.5, 0.1])) for env in envs]
    assert all(np.array_equal(results[0][0][name], results[1][0][name]) for name in one)
    assert results[0][1:] == results[1][1:]


def test_only_this_environment_is_recorded(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="only SocNav2-v0 can be recorded, got CartPoleEnv"):
        RecordTrajectory(gym.make("CartPole-v1"), tmp_path)


def test_a_scene_must_have_begun() -> None:
    with pytest.raises(gym.error.ResetNeeded):
        record_episode(SocNavEnv(reward="sparse"))


def test_files_that_are_none_are_refused(tmp_path: Path) -> None:
    assert "cannot read it: No such file" in refusal(tmp_path / "missing.npz")
    other = tmp_path / "other.npz"
    for content in (b"", b"{}", b"PK", np.zeros(9).tobytes()):
        other.write_bytes(content)
        assert refusal(other) == "must be a whole .npz file, it is none or its end is missing"
    np.savez(other, poses=np.zeros(3))
    assert refusal(other).startswith("must be a socnav2-trajectory file")


@pytest.mark.parametrize("share", [0.2, 0.5, 0.99])
def test_a_file_cut_short_is_refused(file: Path, share: float) -> None:
    content = file.read_bytes()
    file.write_bytes(content[: int(share * len(content))])
    assert "its end is missing" in refusal(file)


def test_no_flipped_byte_goes_unnoticed_or_is_answered_with_a_traceback(file: Path, recording: Recording) -> None:
    content = file.read_bytes()
    refused = 0
    for place in np.random.default_rng(0).integers(0, len(content), 60).tolist():
        file.write_bytes(content[:place] + bytes([content[place] ^ 0x55]) + content[place + 1 :])
        try:
            read = read_recording(file)
        except RecordingError as error:
            assert "\n" not in str(error)
            refused += 1
        else:  # a byte that says nothing, like the time of day in a zip file
            for name in STATE_ARRAYS:
                np.testing.assert_array_equal(getattr(read.trajectory, name), getattr(recording.trajectory, name))
    assert refused > 45


def test_nothing_is_unpickled(file: Path) -> None:
    rewrite(file, times=np.array([object()], dtype=object))
    assert "Object arrays cannot be loaded when allow_pickle=False" in refusal(file)


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ({"format": "other"}, "must be a socnav2-trajectory file"),
        ({"format_version": 1}, f"format_version must be {FORMAT_VERSION}, got 1; record it again"),
        ({"new": 1}, "check new"),
        ({"versions": ["numpy"]}, "versions must give a text for each name"),
        ({"config": {"robots": 1}}, "config: unknown key robots"),
        ({"config": {"time_limit": 0.2}}, "must have at most 1 steps"),
        ({"random_state": 7}, "random_state must be the state of a PCG64 generator"),
        ({"random_state": {"bit_generator": "MT19937"}}, "random_state must be the state of a PCG64 generator"),
        ({"relations": ["a"] * 99}, "relations must name each of"),
        ({"relations": "talking"}, "relations must be a list of texts, got 'talking'"),
        ({"outcome": "won"}, "outcome must be null or one of arrived, "),
        ({"scorer": 3}, "scorer must be a text or null, got 3"),
    ],
)
def test_a_header_that_breaks_a_rule_is_refused(file: Path, header: dict, message: str) -> None:
    rewrite(file, header)
    assert message in refusal(file)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"scores": None}, "scores is missing"),
        ({"header": None}, "must be a socnav2-trajectory file"),
        ({"header": np.frombuffer(b"{", dtype=np.uint8)}, "the header must be JSON"),
        ({"goal": np.zeros(2, dtype=np.float32)}, "goal must be of type float64, got float32"),
        ({"goal": np.zeros(3)}, "goal must have shape (2), got (3,)"),
        ({"goal": np.array([0.0, np.nan])}, "goal must be finite numbers"),
        ({"times": np.zeros(11)}, "times must rise"),
        ({"times": np.arange(5.0)}, "must have shape (5, 3), got (11, 3)"),
        ({"commands": np.zeros((3, 3))}, "commands must have shape (10, 3), got (3, 3)"),
        ({"corners": np.zeros((2, 2))}, "corners must be at least three, got 2"),
        ({"object_kinds": None}, "object_kinds is missing"),
    ],
)
def test_arrays_that_break_a_rule_are_refused(file: Path, arrays: dict, message: str) -> None:
    rewrite(file, **arrays)
    assert message in refusal(file)


def test_interactions_must_be_between_who_is_there(file: Path) -> None:
    rewrite(file, {"relations": ["talking"]}, interaction_pairs=np.array([[0, 99]]))
    assert "interaction_pairs must be of entities 0 to " in refusal(file)
    assert "got 99" in refusal(file)


def test_an_unfinished_write_leaves_no_file(recording: Recording, tmp_path: Path, monkeypatch) -> None:
    def fail(*_arguments, **_arrays) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(np, "savez_compressed", fail)
    with pytest.raises(KeyboardInterrupt):
        write_recording(recording, tmp_path / "episode.npz")
    assert not list(tmp_path.iterdir())


def test_a_file_object_of_numpy_reads_it_too(file: Path) -> None:
    with np.load(io.BytesIO(file.read_bytes())) as archive:
        assert archive["robot_poses"].shape == (11, 3)
