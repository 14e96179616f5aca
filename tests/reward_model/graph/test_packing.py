import pickle

import numpy as np
import pytest

from reward_model.graph.features import COLUMNS, NodeKind
from reward_model.graph.frame import FrameGraph
from reward_model.graph.packing import NUM_PACKED, num_words, packed, unpacked, views
from reward_model.graph.windows import mirrored_frame
from tests.reward_model.random_scenes import random_windows


def frames() -> list[FrameGraph]:
    return [frame for seed in range(3) for window in random_windows(seed) for frame in window]


def assert_same(first: FrameGraph, second: FrameGraph):
    for name, array in first.arrays._asdict().items():
        other = getattr(second.arrays, name)
        np.testing.assert_array_equal(array, other, err_msg=name)
        assert array.dtype == other.dtype, name


def test_what_is_packed_can_be_unpacked():
    for frame in frames():
        arrays = frame.arrays
        words = packed(arrays)
        np.testing.assert_array_equal(words, frame.words)
        assert words.dtype == np.int32
        assert words[:2].tolist() == [len(frame), len(arrays.link_lengths)]
        assert_same(FrameGraph(*unpacked(words)), frame)


def test_frames_may_stand_one_after_the_other():
    for frame in frames():
        assert len(frame.words) % 2 == 0
        joined = np.concatenate([frame.words, [99, 99]]).astype(np.int32)
        assert num_words(joined, 0) == len(frame.words)


def test_features_of_other_kinds_are_left_out():
    frame = frames()[0]
    wrong = frame.arrays.features.copy()
    wrong[frame.arrays.kinds == NodeKind.WALL, 41] = 7.0  # a goal's
    assert_same(FrameGraph(*unpacked(frame.replaced(features=wrong).words)), frame)


def test_columns_are_those_that_are_not_zero():
    seen = {kind: set() for kind in NodeKind}
    for frame in frames():
        for kind, row in zip(frame.arrays.kinds.tolist(), frame.arrays.features, strict=True):
            seen[NodeKind(kind)] |= set(np.flatnonzero(row).tolist())
    for kind, columns in enumerate(COLUMNS):
        assert len(columns) <= NUM_PACKED
        assert seen[NodeKind(kind)] <= set(columns) - {5, 6, 7}


def test_views_share_the_memory_of_the_words():
    words = frames()[0].words.copy()
    views(words).lengths[1] = 0.25
    assert unpacked(words).lengths[1] == 0.25


@pytest.mark.parametrize("form", ["words", "arrays"])
def test_a_frame_is_the_same_whatever_it_was_made_of(form):
    for frame in frames():
        made = FrameGraph.of_words(frame.words) if form == "words" else FrameGraph(*frame.arrays)
        assert len(made) == len(frame) == len(frame.arrays.kinds)
        assert made.num_links == frame.num_links == len(frame.arrays.link_lengths)
        assert_same(made, frame)
        np.testing.assert_array_equal(made.words, frame.words)
        assert_same(pickle.loads(pickle.dumps(made)), frame)
        assert_same(mirrored_frame(mirrored_frame(made)), frame)
