"""Many windows of frames as one set of padded tensors: what the compiled networks read.

Every window is laid out on the same grid of as many frames as the longest window has, 3 at most, by `num_slots`
slots, all newest frames first. The room stands in slot 0 and a thing keeps its slot in all frames, so a temporal edge
joins equal slots and the edges to and from the room need no index at all. Only links (interactions, people near walls)
are stored as lists.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Final

import numpy as np
import torch
from torch import Tensor

from reward_model.base.arrays import Float32Array, IntArray
from reward_model.graph.features import NUM_NODE_FEATURES, TIME_FEATURES, NodeKind, Relation
from reward_model.graph.frame import FrameGraph
from reward_model.graph.packing import FrameArrays
from reward_model.graph.windows import matching_nodes

LINK_RELATIONS: Final = (
    Relation.OBJECT_PERSON,
    Relation.PERSON_OBJECT,
    Relation.PERSON_PERSON,
    Relation.PERSON_WALL,
    Relation.WALL_PERSON,
)
ABSENT: Final = -1  # the kind of an empty slot


@dataclass(frozen=True, eq=False)
class WindowBatch:
    """Padded windows.

    Attributes:
        features: (num_frames, batch, num_slots, 42)
        kinds: (num_frames, batch, num_slots) of `NodeKind`, or `ABSENT`
        lengths: (num_frames, batch, num_slots) of the room edges [dam]
        degrees: (num_frames, batch, num_slots) incoming edges, at least 1
        together: (num_frames - 1, batch, num_slots) 1 where a slot is filled in this frame and in the next older one
        link_sources, link_targets: (num_links,) places in the flattened num_frames * batch * num_slots grid
        link_lengths: (num_links,) [dam or m]
        link_counts: how many links of each of `LINK_RELATIONS`; links are sorted that way
    """

    features: Tensor
    kinds: Tensor
    lengths: Tensor
    degrees: Tensor
    together: Tensor
    link_sources: Tensor
    link_targets: Tensor
    link_lengths: Tensor
    link_counts: tuple[int, ...]

    def to(self, device: torch.device | str) -> WindowBatch:
        """The same batch on another device."""
        tensors = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "link_counts"}
        return replace(self, **{name: tensor.to(device) for name, tensor in tensors.items()})


def pack_windows(windows: Sequence[Sequence[FrameGraph]]) -> WindowBatch:
    """Lay windows, each one to three frames newest first, out on one grid."""
    opened = [[frame.arrays for frame in window] for window in windows]
    slots = [_slots(window) for window in opened]
    num_slots = max(int(places.max()) + 1 for window in slots for places in window)
    shape = (max(map(len, windows)), len(windows), num_slots)
    features = np.zeros((*shape, NUM_NODE_FEATURES), dtype=np.float32)
    kinds = np.full(shape, ABSENT, dtype=np.int64)
    lengths = np.zeros(shape, dtype=np.float32)
    links = []
    for index, (window, window_slots) in enumerate(zip(opened, slots, strict=True)):
        for time, (frame, places) in enumerate(zip(window, window_slots, strict=True)):
            features[time, index, places] = frame.features
            features[time, index, places, TIME_FEATURES + time] = 1
            kinds[time, index, places] = frame.kinds
            lengths[time, index, places] = frame.lengths
            start = (time * len(windows) + index) * num_slots
            links.append(
                (
                    places[frame.link_sources] + start,
                    places[frame.link_targets] + start,
                    frame.link_relations,
                    frame.link_lengths,
                )
            )
    sources, targets, relations, link_lengths = (np.concatenate(columns) for columns in zip(*links, strict=True))
    order = np.argsort(relations, kind="stable")
    counts = tuple(int((relations == relation).sum()) for relation in LINK_RELATIONS)
    together = ((kinds[:-1] >= 0) & (kinds[1:] >= 0)).astype(np.float32)
    return WindowBatch(
        features=torch.from_numpy(features),
        kinds=torch.from_numpy(kinds),
        lengths=torch.from_numpy(lengths),
        degrees=torch.from_numpy(_degrees(kinds, together, targets)),
        together=torch.from_numpy(together),
        link_sources=torch.from_numpy(sources[order]),
        link_targets=torch.from_numpy(targets[order]),
        link_lengths=torch.from_numpy(link_lengths[order]),
        link_counts=counts,
    )


def _slots(window: Sequence[FrameArrays]) -> list[IntArray]:
    """For each frame, the slot of each of its nodes; new things of older frames get slots of their own."""
    keys = window[0].keys
    slots = [np.arange(len(keys))]
    for frame in window[1:]:
        if np.array_equal(frame.keys, keys):
            slots.append(np.arange(len(keys)))
            continue
        places = np.full(len(frame.keys), -1)
        known, nodes = matching_nodes(keys, frame.keys)
        places[nodes] = known
        unknown = places < 0
        places[unknown] = len(keys) + np.arange(unknown.sum())
        keys = np.concatenate([keys, frame.keys[unknown]])
        slots.append(places)
    return slots


def _degrees(kinds: IntArray, together: Float32Array, link_targets: IntArray) -> Float32Array:
    filled = kinds >= 0
    degrees = np.bincount(link_targets, minlength=kinds.size).reshape(kinds.shape).astype(np.float32)
    degrees += 1 + filled  # itself, and the room
    rooms = kinds == NodeKind.ROOM
    degrees += rooms * (filled.sum(axis=2, keepdims=True) - 2)  # the room receives from all others, not from itself
    degrees[:-1] += together
    degrees[1:] += together
    result: Float32Array = np.maximum(degrees, 1)
    return result
