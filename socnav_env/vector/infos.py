"""Infos of many worlds in the one dict that Gymnasium's vector environments return."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

NUMBERS = (int, float, bool)


def batch_infos(infos: Mapping[int, dict[str, Any]], num_envs: int) -> dict[str, Any]:
    """Gather the infos of single environments key by key, as `VectorEnv._add_info` does one after the other.

    The values of each key become an array with a row for every environment, of zeros or None where an environment has
    no such key; beside it `_key`, (num_envs,), marks the environments that have it. Dicts are gathered in the same way,
    only `final_obs` are left as they are.

    Args:
        infos: by the environment's index
    """
    batch: dict[str, Any] = {}
    order = sorted(infos)
    for key in dict.fromkeys(chain.from_iterable(infos.values())):
        indices = [index for index in order if key in infos[index]]
        present = np.ones(num_envs, dtype=np.bool_)
        if len(indices) < num_envs:
            present[:] = False
            present[indices] = True
        column = [infos[index][key] for index in indices]
        batch[key], batch[f"_{key}"] = _batch_column(key, indices, column, num_envs), present
    return batch


def _batch_column(key: str, indices: list[int], column: list[Any], num_envs: int) -> dict[str, Any] | NDArray[Any]:
    """One key's values, of the environments that have it."""
    first = column[0]
    if isinstance(first, dict) and key != "final_obs":
        return batch_infos(dict(zip(indices, column, strict=True)), num_envs)
    if len(column) == num_envs and type(first) in NUMBERS and key != "final_obs":
        return np.array(column, dtype=type(first))
    values = _empty(key, first, num_envs)
    if values.dtype == object:
        for index, value in zip(indices, column, strict=True):
            values[index] = value
    else:
        values[indices] = column
    return values


def _empty(key: str, first: Any, num_envs: int) -> NDArray[Any]:
    """Rows for values like the first one."""
    if key != "final_obs" and (type(first) in NUMBERS or isinstance(first, np.number)):
        return np.zeros(num_envs, dtype=type(first))
    if key != "final_obs" and isinstance(first, np.ndarray):
        return np.zeros((num_envs, *first.shape), dtype=first.dtype)
    return np.full(num_envs, None, dtype=object)


def join_infos(parts: Sequence[dict[str, Any]], sizes: Sequence[int]) -> dict[str, Any]:
    """Put what `batch_infos` returned for some environments, and for the next ones, into one dict, as if for all.

    Args:
        sizes: how many environments each part is of
    """
    keys = dict.fromkeys(key for part in parts for key in part)
    return {key: _joined([part.get(key) for part in parts], sizes) for key in keys}


def _joined(parts: Sequence[Any], sizes: Sequence[int]) -> dict[str, Any] | NDArray[Any]:
    """One key's values; None where a part has none."""
    first = next(part for part in parts if part is not None)
    if isinstance(first, dict):
        return join_infos([{} if part is None else part for part in parts], sizes)
    fill = None if first.dtype == object else first.dtype.type(0)
    return np.concatenate(
        [
            np.full((size, *first.shape[1:]), fill, dtype=first.dtype) if part is None else part
            for part, size in zip(parts, sizes, strict=True)
        ]
    )


def split_infos(batch: Mapping[str, Any], num_envs: int) -> list[dict[str, Any]]:
    """The infos of single environments that `batch_infos` gathered, numbers as Python's own."""
    infos: list[dict[str, Any]] = [{} for _ in range(num_envs)]
    for key, values in batch.items():
        present = batch.get(f"_{key}")
        if present is None:  # this says itself where another key is present
            continue
        rows = split_infos(values, num_envs) if isinstance(values, dict) else _rows(values)
        for index in np.flatnonzero(present).tolist():
            infos[index][key] = rows[index]
    return infos


def _rows(values: NDArray[Any]) -> list[Any]:
    return values.tolist() if values.ndim == 1 else list(values)


def merged_infos(infos: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The info of an action that lasted several control periods.

    The last one's, with reward terms added up, scores averaged, and `control_steps`, how many periods there were.
    """
    merged = {**infos[-1], "control_steps": len(infos)}
    if "reward_terms" in merged:
        names = merged["reward_terms"]
        merged["reward_terms"] = {name: sum(info["reward_terms"][name] for info in infos) for name in names}
    for name in ("q1", "q2", "q1_std", "q2_std"):
        if name in merged:
            merged[name] = sum(info[name] for info in infos) / len(infos)
    if "in_range" in merged:
        merged["in_range"] = all(info["in_range"] for info in infos)
    return merged
