"""A frame's graph packed into one array of words, which environments store and the fused network reads.

Passing eight arrays between compiled code and Python takes longer than computing them. At most 15 of a node's 42
features can differ from 0, depending on its kind.

The words, 32 bits each: the numbers of nodes and of links, the surroundings (4), the nodes' keys (two words each),
kinds, lengths and 16 features each, then the links' sources, targets, relations and lengths. One more word may make
their number even.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from reward_model.base.arrays import Float32Array, Int32Array, IntArray
from reward_model.base.numba import njit
from reward_model.graph.features import COLUMNS, NUM_NODE_FEATURES

NUM_PACKED: Final = 16  # features of a node, as many as one vector of a processor holds
NUM_SURROUNDINGS: Final = 4  # see `FrameGraph`
_HEADER = 2 + NUM_SURROUNDINGS
_TABLE = np.array([(*columns, *[-1] * (NUM_PACKED - len(columns))) for columns in COLUMNS])
_WIDTHS = np.array([len(columns) for columns in COLUMNS])


class FrameArrays(NamedTuple):
    """The arrays of a `FrameGraph`, in its order."""

    features: Float32Array
    kinds: Int32Array
    keys: IntArray
    lengths: Float32Array
    link_sources: Int32Array
    link_targets: Int32Array
    link_relations: Int32Array
    link_lengths: Float32Array
    surroundings: Float32Array


class Stack(NamedTuple):
    """The packed frames of several windows, one after the other.

    Attributes:
        words: of all frames, a window's newest first
        sizes: (num_windows,) number of frames of each window
    """

    words: Int32Array
    sizes: IntArray


@njit
def empty_words(num_nodes: int, num_links: int) -> Int32Array:
    """Words for these numbers of nodes and links, with all else 0."""
    size = _HEADER + num_nodes * (NUM_PACKED + 4) + 4 * num_links
    words = np.zeros(size + size % 2, dtype=np.int32)
    words[0], words[1] = num_nodes, num_links
    return words


@njit
def num_words(words: Int32Array, start: int) -> int:
    """The number of words of the frame that begins at `start`."""
    size: int = _HEADER + words[start] * (NUM_PACKED + 4) + 4 * words[start + 1]
    return size + size % 2


class Offsets(NamedTuple):
    """The first word of each of a frame's arrays, named as in `FrameArrays`."""

    surroundings: int
    keys: int
    kinds: int
    lengths: int
    features: int
    link_sources: int
    link_targets: int
    link_relations: int
    link_lengths: int


@njit
def offsets(words: Int32Array, start: int) -> Offsets:
    """The offsets of the frame that begins at `start`."""
    nodes, links = words[start], words[start + 1]
    keys = start + _HEADER
    features = keys + 4 * nodes
    sources = features + NUM_PACKED * nodes
    return Offsets(
        start + 2,
        keys,
        keys + 2 * nodes,
        keys + 3 * nodes,
        features,
        sources,
        sources + links,
        sources + 2 * links,
        sources + 3 * links,
    )


@njit
def views(words: Int32Array) -> FrameArrays:
    """A frame's arrays as views of its words; features are (num_nodes, 16)."""
    nodes, links, at = words[0], words[1], offsets(words, 0)
    return FrameArrays(
        words[at.features : at.link_sources].view(np.float32).reshape(nodes, NUM_PACKED),
        words[at.kinds : at.lengths],
        words[at.keys : at.kinds].view(np.int64),
        words[at.lengths : at.features].view(np.float32),
        words[at.link_sources : at.link_targets],
        words[at.link_targets : at.link_relations],
        words[at.link_relations : at.link_lengths],
        words[at.link_lengths : at.link_lengths + links].view(np.float32),
        words[at.surroundings : at.keys].view(np.float32),
    )


@njit
def packed(arrays: FrameArrays) -> Int32Array:
    """A frame's words, from features (num_nodes, 42); only those of a node's kind are kept."""
    words = empty_words(len(arrays.kinds), len(arrays.link_lengths))
    frame = views(words)
    for node in range(len(arrays.kinds)):
        kind = arrays.kinds[node]
        for index in range(_WIDTHS[kind]):
            frame.features[node, index] = arrays.features[node, _TABLE[kind, index]]
    frame.kinds[:], frame.keys[:], frame.lengths[:] = arrays.kinds, arrays.keys, arrays.lengths
    frame.link_sources[:], frame.link_targets[:] = arrays.link_sources, arrays.link_targets
    frame.link_relations[:], frame.link_lengths[:] = arrays.link_relations, arrays.link_lengths
    frame.surroundings[:] = arrays.surroundings
    return words


def packed_signs(signs: Float32Array) -> Float32Array:
    """Signs (42,) of a node's features as (5, 16), for each kind those of the features it can have."""
    padded = np.append(signs, np.float32(1.0))
    return np.ascontiguousarray(padded[_TABLE])


@njit
def with_signs(words: Int32Array, signs: Float32Array) -> Int32Array:
    """A copy of a frame's words with features times `packed_signs`."""
    changed = words.copy()
    frame = views(changed)
    for node in range(len(frame.kinds)):
        for index in range(NUM_PACKED):
            frame.features[node, index] *= signs[frame.kinds[node], index]
    return changed


@njit
def unpacked(words: Int32Array) -> FrameArrays:
    """Copies of a frame's arrays, with all 42 features."""
    frame = views(words)
    features = np.zeros((len(frame.kinds), NUM_NODE_FEATURES), dtype=np.float32)
    for node in range(len(frame.kinds)):
        kind = frame.kinds[node]
        for index in range(_WIDTHS[kind]):
            features[node, _TABLE[kind, index]] = frame.features[node, index]
    return FrameArrays(
        features,
        frame.kinds.copy(),
        frame.keys.copy(),
        frame.lengths.copy(),
        frame.link_sources.copy(),
        frame.link_targets.copy(),
        frame.link_relations.copy(),
        frame.link_lengths.copy(),
        frame.surroundings.copy(),
    )
