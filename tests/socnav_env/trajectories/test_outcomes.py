from types import SimpleNamespace

import pytest

from socnav_env.trajectories.outcomes import Outcome, decide_outcome
from tests.socnav_env.puppets import PuppetWorld


@pytest.mark.parametrize(
    ("touched", "at_goal", "steps_left", "outcome"),
    [
        ((), False, 1, None),
        ((), False, 0, Outcome.TIMEOUT),
        ((), True, 0, Outcome.ARRIVED),
        ((), True, 9, Outcome.ARRIVED),
        (("wall",), True, 9, Outcome.COLLISION_WALL),
        (("wall", "object"), False, 0, Outcome.COLLISION_OBJECT),
        (("wall", "object", "person"), True, 0, Outcome.COLLISION_PERSON),
    ],
)
def test_contacts_outweigh_arriving_and_arriving_outweighs_the_time(touched, at_goal, steps_left, outcome) -> None:
    world = PuppetWorld()
    world.contacts = SimpleNamespace(**{name: name in touched for name in ("person", "object", "wall")})
    world.at_goal = at_goal
    assert decide_outcome(world, steps_left) is outcome


def test_only_collisions_are_collisions() -> None:
    assert [outcome.value for outcome in Outcome if outcome.is_collision] == [
        "collision_person",
        "collision_object",
        "collision_wall",
    ]
