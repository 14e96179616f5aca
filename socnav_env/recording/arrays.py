"""The arrays of a recording: their types and shapes, and the checks on reading."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from socnav_env.config import EnvConfig
from socnav_env.layout import Ending, Layout, ObjectKind, Room, Script
from socnav_env.trajectories.outcomes import Outcome
from socnav_env.trajectories.trajectory import Trajectory

FORMAT: Final = "socnav2-trajectory"
Arrays = dict[str, NDArray[Any]]
Shape = tuple[int | str, ...]

# Dtype and shape; a name stands for the same size wherever it appears, "rows" for one more than "steps",
# "told_rows" for one more than "told", the number of control periods in the script's warm-up.
LAYOUT_ARRAYS: Final[dict[str, tuple[str, Shape]]] = {
    "corners": ("float64", ("corners", 2)),
    "start": ("float64", (3,)),
    "goal": ("float64", (2,)),
    "people_start": ("float64", ("people", 3)),
    "people_walk": ("bool", ("people",)),
    "people_group": ("int64", ("people",)),
    "object_poses": ("float64", ("objects", 3)),
    "object_sizes": ("float64", ("objects", 2)),
    "object_kinds": ("int64", ("objects",)),
    "interaction_pairs": ("int64", ("interactions", 2)),
}
STATE_ARRAYS: Final[dict[str, tuple[str, Shape]]] = {
    "times": ("float64", ("rows",)),
    "robot_poses": ("float64", ("rows", 3)),
    "robot_velocities": ("float64", ("rows", 3)),
    "people_poses": ("float64", ("rows", "people", 3)),
    "people_velocities": ("float64", ("rows", "people", 3)),
    "people_targets": ("float64", ("rows", "people", 2)),
    "commands": ("float64", ("steps", 3)),
    "scores": ("float64", ("steps", 2)),
}
SCRIPT_ARRAYS: Final[dict[str, tuple[str, Shape]]] = {  # only in recordings of scenarios; there all of them
    "script_robot_poses": ("float64", ("told_rows", 3)),
    "script_commands": ("float64", ("told", 3)),
    "script_people_poses": ("float64", ("told_rows", "people", 3)),
    "script_velocities": ("float64", ("people", 3)),
    "script_speeds": ("float64", ("people",)),
    "script_routes": ("float64", ("people", "places", 2)),
    "script_delays": ("float64", ("people",)),
    "script_endings": ("int64", ("people",)),
}
CHANGE_ARRAYS: Final[dict[str, tuple[str, Shape]]] = {  # only where people joined or left a conversation
    "interaction_changes": ("int64", ("changes", 4)),
}
# Errors that NumPy and zipfile raise for damaged files: wrong checksums, sizes, names, unknown compression.
DAMAGE: Final = (
    ValueError,
    OSError,
    EOFError,
    LookupError,
    MemoryError,
    OverflowError,
    RuntimeError,
    struct.error,
    zipfile.BadZipFile,
    zlib.error,
)
LONGEST_COMPLAINT: Final = 100  # characters of the message of NumPy or zipfile, which may quote the damage
MAY_BE_NAN: Final = ("scores", "script_speeds", "script_routes")
SCRIPT: Final = "script_"  # prefix of the names of a script's arrays


class RecordingError(ValueError):
    """A recording breaks a rule. The message names the file, the place, the value and the rule."""


def arrays_of(trajectory: Trajectory) -> Arrays:
    """The arrays written for an episode, besides its header."""
    layout = trajectory.layout
    arrays: Arrays = {
        "corners": layout.room.corners,
        "start": layout.robot_pose,
        "people_start": layout.people_poses,
    }
    arrays |= {name: getattr(layout, name) for name in LAYOUT_ARRAYS if name not in arrays}
    if layout.script is not None:
        arrays |= {name: getattr(layout.script, name.removeprefix(SCRIPT)) for name in SCRIPT_ARRAYS}
    if len(trajectory.interaction_changes):
        arrays |= {name: getattr(trajectory, name) for name in CHANGE_ARRAYS}
    return arrays | {name: getattr(trajectory, name) for name in STATE_ARRAYS}


def read_arrays(content: bytes, place: str) -> Arrays:
    """Read all arrays of a file.

    Raises:
        RecordingError: If it is no .npz file, is damaged, or has an array that needs unpickling.
    """
    if not zipfile.is_zipfile(io.BytesIO(content)):
        raise RecordingError(f"{place}: must be a whole .npz file, it is none or its end is missing")
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except DAMAGE as error:
        what = repr(str(error) or type(error).__name__)[1:-1]
        raise RecordingError(f"{place}: the file is damaged: {what[:LONGEST_COMPLAINT]}") from error
    strange = [name for name, array in arrays.items() if not isinstance(array, np.ndarray)]
    if strange:
        raise RecordingError(f"{place}: {strange[0]} must be an array as NumPy saves it")
    return arrays


def layout_of(arrays: Arrays, relations: object, place: str) -> Layout:
    """The layout in a recording's arrays; raises `RecordingError` where they break a rule."""
    _check(arrays, place)
    pairs, most = arrays["interaction_pairs"], len(arrays["people_start"]) + len(arrays["object_poses"]) - 1
    if not (isinstance(relations, list) and all(isinstance(each, str) for each in relations)):
        raise RecordingError(f"{place}: relations must be a list of texts, got {relations!r}")
    if len(relations) != len(pairs):
        raise RecordingError(f"{place}: relations must name each of {len(pairs)} pairs, got {len(relations)}")
    for entity in pairs[(pairs < 0) | (pairs > most)][:1].tolist():
        raise RecordingError(f"{place}: interaction_pairs must be of entities 0 to {most}, got {entity}")
    for kind in arrays["object_kinds"].tolist():
        if kind not in list(ObjectKind):
            raise RecordingError(f"{place}: object_kinds must be 0 to {max(ObjectKind)}, got {kind}")
    named = {name: arrays[name] for name in LAYOUT_ARRAYS if name not in ("corners", "start", "people_start")}
    return Layout(
        room=Room(arrays["corners"]),
        robot_pose=arrays["start"],
        people_poses=arrays["people_start"],
        interaction_relations=tuple(relations),
        script=_script_of(arrays, place),
        **named,
    )


def trajectory_of(arrays: Arrays, layout: Layout, config: EnvConfig, outcome: object, place: str) -> Trajectory:
    """The episode in a recording's arrays, which `layout_of` must have checked."""
    if not (outcome is None or outcome in list(Outcome)):
        raise RecordingError(f"{place}: outcome must be null or one of {', '.join(Outcome)}, got {outcome!r}")
    steps = len(arrays["commands"])
    if steps > config.max_steps:
        raise RecordingError(f"{place}: must have at most {config.max_steps} steps as config says, got {steps}")
    if layout.script is not None and len(layout.script.commands) != config.warm_up_steps:
        told = len(layout.script.commands)
        raise RecordingError(f"{place}: script_commands must be {config.warm_up_steps} as config says, got {told}")
    if not (np.diff(arrays["times"]) > 0).all():
        raise RecordingError(f"{place}: times must rise")
    if _changes_in(arrays):
        _check_changes(arrays["interaction_changes"], steps, layout.num_people, place)
    return Trajectory(
        layout=layout,
        robot_radius=config.robot.radius,
        people_radius=config.people.radius,
        top_speed=config.robot.top_speed,
        outcome=None if outcome is None else Outcome(str(outcome)),
        **{name: arrays[name] for name in (STATE_ARRAYS | _changes_in(arrays))},
    )


def _script_of(arrays: Arrays, place: str) -> Script | None:
    """The scenario's script in checked arrays; None without one."""
    if not _has_script(arrays):
        return None
    for ending in arrays["script_endings"].tolist():
        if ending not in list(Ending):
            raise RecordingError(f"{place}: script_endings must be 0 to {max(Ending)}, got {ending}")
    return Script(**{name.removeprefix(SCRIPT): arrays[name] for name in SCRIPT_ARRAYS})


def _has_script(arrays: Arrays) -> bool:
    return any(name in arrays for name in SCRIPT_ARRAYS)


def _changes_in(arrays: Arrays) -> dict[str, tuple[str, Shape]]:
    return {name: rule for name, rule in CHANGE_ARRAYS.items() if name in arrays}


def _check_changes(changes: NDArray[np.int64], steps: int, num_people: int, place: str) -> None:
    """Refuse changes of interactions that are impossible."""
    rows, one, other, begins = changes.T
    possible = (rows >= 0) & (rows <= steps) & (one >= 0) & (one < other) & (other < num_people)
    possible &= (begins == 0) | (begins == 1)
    possible[1:] &= np.diff(rows) >= 0
    for change in changes[~possible][:1].tolist():
        raise RecordingError(
            f"{place}: interaction_changes must be rising rows up to {steps}, two of {num_people} people, lower index "
            f"first, and 0 or 1, got {change}"
        )


def _check(arrays: Arrays, place: str) -> None:
    """Refuse arrays that are missing, of another type or shape, or not finite."""
    sizes: dict[str, int] = {}
    expected = LAYOUT_ARRAYS | STATE_ARRAYS | (SCRIPT_ARRAYS if _has_script(arrays) else {}) | _changes_in(arrays)
    for name, (dtype, shape) in expected.items():
        if name not in arrays:
            raise RecordingError(f"{place}: {name} is missing")
        array = arrays[name]
        if array.dtype != np.dtype(dtype):
            raise RecordingError(f"{place}: {name} must be of type {dtype}, got {array.dtype}")
        _check_shape(array, shape, sizes, f"{place}: {name}")
        if name not in MAY_BE_NAN and not np.isfinite(array).all():
            raise RecordingError(f"{place}: {name} must be finite numbers")
    if sizes["corners"] < 3:
        raise RecordingError(f"{place}: corners must be at least three, got {sizes['corners']}")


def _check_shape(array: NDArray[Any], shape: Shape, sizes: dict[str, int], where: str) -> None:
    """Refuse an array of another shape; sizes: known sizes by name, which this array may add to."""
    for size, symbol in zip(array.shape, shape, strict=False):
        if isinstance(symbol, str):
            sizes.setdefault(symbol, size)
    for rows, steps in (("rows", "steps"), ("told_rows", "told")):
        if rows in sizes:
            sizes.setdefault(steps, sizes[rows] - 1)
    expected = tuple(sizes.get(each, each) if isinstance(each, str) else each for each in shape)
    if array.shape != expected:
        raise RecordingError(f"{where} must have shape ({', '.join(map(str, expected))}), got {array.shape}")
