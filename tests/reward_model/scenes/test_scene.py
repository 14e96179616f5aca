from dataclasses import replace

import numpy as np
import pytest

from reward_model.scenes.scene import Interactions, Objects, People, ScenarioError, SceneSequence, Snapshot


def snapshot(**changes) -> Snapshot:
    """Two people and an object."""
    made = Snapshot(
        timestamp=1.0,
        interval=0.2,
        command=np.zeros(3),
        goal=np.array([1.0, 0.0]),
        people=People(np.array([1, 2]), np.zeros((2, 3)), np.zeros((2, 3))),
        objects=Objects(np.array([3]), np.zeros((1, 3)), np.zeros((1, 3)), np.ones((1, 2))),
        walls=np.zeros((4, 4)),
        interactions=Interactions(np.array([[1, 3]]), ("human_plant_interaction",)),
    )
    return replace(made, **changes)


def people(**changes) -> People:
    return replace(snapshot().people, **changes)


def test_a_sequence_holds_its_snapshots_in_order():
    first, second = snapshot(), snapshot(timestamp=1.2)
    sequence = SceneSequence((first, second), name="two")
    assert len(sequence) == 2
    assert list(sequence) == [first, second]
    assert sequence.last is second


def test_an_empty_sequence_is_refused():
    with pytest.raises(ScenarioError, match=r"^nothing: a sequence needs at least one snapshot, got none$"):
        SceneSequence((), name="nothing")


@pytest.mark.parametrize("timestamp", [1.0, 0.5])
def test_time_must_pass(timestamp):
    message = rf"^scene: snapshot 1: timestamp must be later than the one before it, got {timestamp} after 1\.0$"
    with pytest.raises(ScenarioError, match=message):
        SceneSequence((snapshot(), snapshot(timestamp=timestamp)), name="scene")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"command": np.zeros(2)}, r"command must have shape \(3,\), got \(2,\)"),
        ({"goal": np.array([np.nan, 0.0])}, r"goal must be finite numbers, got nan"),
        ({"walls": np.zeros((1, 3))}, r"walls must have shape \(1, 4\), got \(1, 3\)"),
        ({"robot_pose": np.zeros(2)}, r"robot_pose must have shape \(3,\), got \(2,\)"),
        ({"timestamp": np.inf}, r"timestamp must be a finite number, got inf"),
        ({"interval": 0.0}, r"interval must be a positive number, got 0\.0"),
        ({"people": people(poses=np.zeros((1, 3)))}, r"people poses must have shape \(2, 3\), got \(1, 3\)"),
        ({"people": people(velocities=np.full((2, 3), np.inf))}, r"people velocities must be finite"),
        ({"people": people(ids=np.array([1, 3]))}, r"id 3 is used twice"),
        (
            {"interactions": Interactions(np.array([[1, 9]]), ("x",))},
            r"interaction 1-9 names id 9, which no person or object has",
        ),
        (
            {"interactions": Interactions(np.array([[2, 2]]), ("x",))},
            r"interaction 2-2 must join two different entities",
        ),
    ],
)
def test_what_breaks_a_rule_is_named_with_its_snapshot(change, message):
    with pytest.raises(ScenarioError, match=rf"^scene: snapshot 1: {message}"):
        SceneSequence((snapshot(), replace(snapshot(timestamp=2.0), **change)), name="scene")
