"""Outcomes of episodes, and the one function that decides them."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from socnav_env.simulation.world import World


class Outcome(StrEnum):
    """The outcome of an episode."""

    ARRIVED = "arrived"
    COLLISION_PERSON = "collision_person"
    COLLISION_OBJECT = "collision_object"
    COLLISION_WALL = "collision_wall"
    TIMEOUT = "timeout"

    @property
    def is_collision(self) -> bool:
        """Whether the robot touched something."""
        return self in (Outcome.COLLISION_PERSON, Outcome.COLLISION_OBJECT, Outcome.COLLISION_WALL)


def decide_outcome(world: World, steps_left: int) -> Outcome | None:
    """The outcome of the episode at this moment, None if it goes on.

    A contact takes precedence over arriving (success is to arrive without touching anything), and arriving over the end
    of the time. Of several contacts the one with a person counts, then the one with an object.
    """
    contacts = world.contacts
    if contacts.person:
        return Outcome.COLLISION_PERSON
    if contacts.object:
        return Outcome.COLLISION_OBJECT
    if contacts.wall:
        return Outcome.COLLISION_WALL
    if world.arrived():
        return Outcome.ARRIVED
    return Outcome.TIMEOUT if steps_left <= 0 else None
