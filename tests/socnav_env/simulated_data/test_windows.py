"""Windows made in bulk."""

import numpy as np

from reward_model.graph.features import NodeKind
from socnav_env.simulated_data.windows import WINDOWS_PER_EPISODE, generate_windows


def test_windows_have_three_frames_of_one_scene():
    for window in generate_windows(4, seed=3):
        assert len(window) == 3
        assert all(np.array_equal(frame.arrays.keys, window[0].arrays.keys) for frame in window)
        assert (window[0].arrays.kinds == NodeKind.GOAL).sum() == 1


def test_number_of_windows_is_exact():
    assert len(generate_windows(WINDOWS_PER_EPISODE + 3, seed=0)) == WINDOWS_PER_EPISODE + 3


def test_same_seed_gives_same_windows_for_any_number_of_jobs():
    alone, together = generate_windows(450, seed=5), generate_windows(450, seed=5, jobs=2)
    for one, other in zip(alone, together, strict=True):
        for first, second in zip(one, other, strict=True):
            assert np.array_equal(first.arrays.features, second.arrays.features)
            assert np.array_equal(first.arrays.link_lengths, second.arrays.link_lengths)


def test_seeds_differ():
    one, other = generate_windows(1, seed=0)[0][0], generate_windows(1, seed=1)[0][0]
    assert one.arrays.features.shape != other.arrays.features.shape or not np.allclose(
        one.arrays.features, other.arrays.features
    )
