import numpy as np

from reward_model.graph.features import (
    COLUMNS,
    LENGTH_FEATURE,
    MIRROR_SIGNS,
    NUM_NODE_FEATURES,
    NUM_RELATIONS,
    OWN,
    TIME_FEATURES,
    WALL_DIRECTION,
    NodeKind,
)


def test_columns_are_those_of_the_published_network():
    assert (NUM_NODE_FEATURES, NUM_RELATIONS, TIME_FEATURES, LENGTH_FEATURE) == (42, 18, 5, 17)
    assert COLUMNS[NodeKind.PERSON] == (0, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16)
    assert COLUMNS[NodeKind.OBJECT] == (1, 5, 6, 7, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29)
    assert COLUMNS[NodeKind.ROOM] == (2, 5, 6, 7, 17, 18, 30, 31)
    assert COLUMNS[NodeKind.WALL] == (3, 5, 6, 7, 32, 33, 34, 35, 36, 37)
    assert COLUMNS[NodeKind.GOAL] == (4, 5, 6, 7, 38, 39, 40, 41)
    assert OWN == 4


def test_every_feature_belongs_to_one_kind_but_time():
    own = [column for columns in COLUMNS for column in (columns[0], *columns[OWN:])]
    assert sorted(own) == [*range(5), *range(8, 42)]


def test_features_that_change_sign_in_a_mirror():
    assert np.flatnonzero(MIRROR_SIGNS == -1).tolist() == [8, 10, 11, 14, 18, 19, 21, 22, 25, 32, 34, 38]
    assert WALL_DIRECTION == [34, 35]
