"""What a scenario file says, as plain data."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final

from socnav_env.layout import Ending, ObjectKind
from socnav_env.scenarios.fields import Amount

STANDS: Final = "stand"  # what people do
WALKS: Final = "walk"
WANDERS: Final = "wander"
ROBOT: Final = "robot"  # names that everyone can look at
GOAL: Final = "goal"


@dataclass(frozen=True)
class Spot:
    """A place, or the rectangle it is drawn from, and by how much it varies in any direction [m]."""

    x: Amount
    y: Amount
    jitter: float = 0.0

    @property
    def is_fixed(self) -> bool:
        """Whether it is always the same."""
        return self.x.is_fixed and self.y.is_fixed and self.jitter == 0


@dataclass(frozen=True)
class Entity:
    """Anything that stands somewhere.

    place: where the file says it, for complaints
    name: what the file calls it, empty where it does not
    heading: [rad], by name what it looks at, or None: whatever suits it
    """

    place: str
    name: str
    spot: Spot
    heading: Amount | str | None

    @property
    def words(self) -> str:
        """What complaints call it."""
        return f"{self.place} ({self.name})" if self.name else self.place


@dataclass(frozen=True)
class PersonEntry(Entity):
    """Somebody, or several alike.

    does: stand, walk (a route) or wander
    companion: name of the one beside whom they walk, empty where they go their own way
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
    """A thing; size: width and depth [m]."""

    kinds: tuple[ObjectKind, ...]
    size: tuple[Amount, Amount]


@dataclass(frozen=True)
class InteractionEntry:
    """Two who interact, by name; relation: None where it follows from who they are."""

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
    """All that a scenario file says.

    overrides: of the environment's configuration
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
