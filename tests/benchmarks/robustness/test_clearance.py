from math import pi

import numpy as np
import pytest

from benchmarks.robustness.clearance import clearance, in_contact
from reward_model.scenes.scene import Interactions, Objects, People, Snapshot


def snapshot(people=(), objects=(), walls=()) -> Snapshot:
    """People (x, y), objects (x, y, heading, width, depth), walls (x1, y1, x2, y2)."""
    places, boxes = np.array(people, dtype=float).reshape(-1, 2), np.array(objects, dtype=float).reshape(-1, 5)
    poses = np.hstack([places, np.zeros((len(places), 1))])
    return Snapshot(
        timestamp=0.0,
        interval=0.2,
        command=np.zeros(3),
        goal=np.zeros(2),
        people=People(np.arange(len(poses)), poses, np.zeros_like(poses)),
        objects=Objects(np.arange(100, 100 + len(boxes)), boxes[:, :3], np.zeros((len(boxes), 3)), boxes[:, 3:]),
        walls=np.array(walls, dtype=float).reshape(-1, 4),
        interactions=Interactions(np.zeros((0, 2), dtype=np.int64), ()),
    )


@pytest.mark.parametrize(
    ("scene", "expected"),
    [
        (snapshot(), np.inf),
        (snapshot(people=[(0.8, 0.6), (-3, 0)]), 0.5),
        (snapshot(people=[(0, 0)]), -0.5),
        (snapshot(objects=[(2, 0, 0, 1, 3)]), 1.25),
        (snapshot(objects=[(2, 0, pi / 2, 1, 3)]), 0.25),
        (snapshot(objects=[(2, 0, pi / 4, 1, 1)]), 2 - 0.5**0.5 - 0.25),
        (snapshot(objects=[(4, 5, 0, 2, 2)]), 4.75),
        (snapshot(objects=[(0.1, 0, 0, 1, 2)]), -0.65),
        (snapshot(objects=[(0, 0, 7, 0, 0)]), -0.25),
        (snapshot(walls=[(1, -1, 1, 1)]), 0.75),
        (snapshot(walls=[(3, 4, 6, 8)]), 4.75),
        (snapshot(walls=[(-1, 0, 1, 0)]), -0.25),
        (snapshot(walls=[(0, 2, 0, 2)]), 1.75),
    ],
)
def test_clearance_is_between_surfaces(scene, expected):
    assert clearance(scene) == pytest.approx(expected)
    assert in_contact(scene) == (expected <= 0)


@pytest.mark.parametrize("number", [5e-324, 1e-310, 1e30, 1e154, 1e200, 1.7e308])
def test_any_finite_coordinates_will_do(number):
    signs = [(1, 1), (-1, 1), (1, -1), (-1, -1)]
    scene = snapshot(
        people=[(a * number, b * number) for a, b in signs],
        objects=[(a * number, b * number, number, number, number) for a, b in signs],
        walls=[(a * number, b * number, -a * number, b * number) for a, b in signs],
    )
    with np.errstate(invalid="raise", divide="raise"):
        assert not np.isnan(clearance(scene))
        in_contact(scene)
    assert in_contact(snapshot(walls=[(-number, -number, number, number)]))


def test_contact_with_what_is_huge_is_counted_beyond_doubt_in_float32():
    assert in_contact(snapshot(people=[(0.5, 0)]))
    assert not in_contact(snapshot(people=[(0.5000001, 0)]))
    # An object of 1,000 km whose surface the robot's touches, and one that it overlaps by 4 m.
    assert not in_contact(snapshot(objects=[(5e5 + 0.25, 0, 0, 1e6, 1e6)]))
    assert in_contact(snapshot(objects=[(5e5 - 3.75, 0, 0, 1e6, 1e6)]))
