"""The contents of a scenario file, as plain data."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final

from socnav_env.layout import Ending, ObjectKind
from socnav_env.scenarios.fields import Amount

STANDS: Final = "stand"  # what a person does
WALKS: Final = "walk"
WANDERS: Final = "wander"
ROBOT: Final = "robot"  # names that a heading can refer to
GOAL: Final = "goal"


@dataclass(frozen=True)
class Spot:
    """A place, or the rectangle it is drawn from, and its jitter in any direction [m]."""

    x: Amount
    y: Amount
    jitter: float = 0.0

    @property
    def is_fixed(self) -> bool:
        """Whether the place is always the same."""
        return self.x.is_fixed and self.y.is_fixed and self.jitter == 0


@dataclass(frozen=True)
class Entity:
    """Anything with a place in the room.

    Attributes:
        place: path of the entry in the file, for error messages
        name: its name in the file, empty without one
        heading: [rad], the name of what it faces, or None: chosen when drawn
    """

    place: str
    name: str
    spot: Spot
    heading: Amount | str | None

    @property
    def words(self) -> str:
        """Its description in error messages."""
        return f"{self.place} ({self.name})" if self.name else self.place


@dataclass(frozen=True)
class PersonEntry(Entity):
    """A person, or several alike.

    Attributes:
        does: stand, walk (a route) or wander
        companion: name of the person they walk beside, empty without one
    """

    count: tuple[int, int]
    does: str
    route: tuple[Spot, ...]
    speed: Amount | None
    delay: Amount
    ending: Ending
    companion: str


@dataclass(frozen=True)
class ObjectEntry(Entity):
    """An object; size: width and depth [m]."""

    kinds: tuple[ObjectKind, ...]
    size: tuple[Amount, Amount]


@dataclass(frozen=True)
class InteractionEntry:
    """Two interacting entities, by name; relation: None if it follows from their kinds."""

    place: str
    between: tuple[str, str]
    relation: str | None


@dataclass(frozen=True)
class RoomEntry:
    """A room: its corners in order, or the sides of a rectangle whose middle is the origin [m]."""

    corners: tuple[tuple[Amount, Amount], ...] = ()
    size: tuple[Amount, Amount] | None = None


@dataclass(frozen=True)
class SceneFile:
    """The contents of a scenario file.

    Attributes:
        overrides: changes to the environment's configuration
    """

    file: str
    description: str
    room: RoomEntry
    robot: Entity
    goal: Entity
    people: tuple[PersonEntry, ...] = ()
    objects: tuple[ObjectEntry, ...] = ()
    interactions: tuple[InteractionEntry, ...] = ()
    overrides: dict[str, Any] = field(default_factory=dict)
