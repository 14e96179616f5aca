from math import pi

import numpy as np
import pytest

from reward_model.analysis.synthetic_scenes import Person, SyntheticScene, Thing
from reward_model.graph.windows import select_window


def test_a_scene_written_out():
    scene = SyntheticScene(
        goal=(3.0, 1.0),
        side=8.0,
        command=(0.5, 0.0),
        people=[Person(2.0, 1.0, pi / 2, 1.0)],
        objects=[Thing(1.0, -1.0, 0.0, 0.8, 0.6)],
        interactions=[(1, 2)],
    )
    sequence = scene.sequence()
    assert [snapshot.timestamp for snapshot in sequence] == pytest.approx([0.2 * index for index in range(11)])
    assert select_window([snapshot.timestamp for snapshot in sequence]) == [10, 5, 0]
    first, last = sequence.snapshots[0], sequence.last
    assert last.interval == 0.2
    np.testing.assert_allclose(last.command, [0.5, 0, 0])
    np.testing.assert_allclose(last.goal, [3, 1])
    np.testing.assert_allclose(first.goal, [4, 1])  # the robot has driven 1 m since
    np.testing.assert_allclose(last.people.poses, [[2, 1, pi / 2]])
    np.testing.assert_allclose(first.people.poses, [[3, -1, pi / 2]], atol=1e-12)
    np.testing.assert_allclose(last.people.velocities, [[-0.5, 1, 0]], atol=1e-12)
    np.testing.assert_allclose(last.objects.velocities, [[-0.5, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(last.objects.sizes, [[0.8, 0.6]])
    np.testing.assert_allclose(last.walls, [[4, 4, 4, -4], [4, -4, -4, -4], [-4, -4, -4, 4], [-4, 4, 4, 4]])
    assert last.interactions.pairs.tolist() == [[1, 2]]


def test_a_turning_robot_sees_everything_turn_the_other_way():
    scene = SyntheticScene(goal=(0.0, 3.0), robot=(0.0, 0.0, pi / 2), command=(0.0, 0.5), people=[Person(0.0, 2.0)])
    last = scene.sequence().last
    np.testing.assert_allclose(last.goal, [3, 0], atol=1e-12)
    np.testing.assert_allclose(last.people.poses, [[2, 0, -pi / 2]], atol=1e-12)
    np.testing.assert_allclose(last.people.velocities[0, 2], -0.5)
    assert last.people.velocities[0, 1] < 0  # what is ahead slides to the right
