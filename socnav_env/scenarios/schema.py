"""Parser of scenario files: YAML to entries, checked field by field. docs/scenarios.md describes the files."""

from __future__ import annotations

import math
from typing import Any, Final

from socnav_env.config import RELATIONS
from socnav_env.config.checks import ConfigError
from socnav_env.layout import Ending, ObjectKind
from socnav_env.scenarios.entries import (
    GOAL,
    ROBOT,
    STANDS,
    WALKS,
    WANDERS,
    Entity,
    InteractionEntry,
    ObjectEntry,
    PersonEntry,
    RoomEntry,
    SceneFile,
    Spot,
)
from socnav_env.scenarios.fields import Amount, Field, optional, read_yaml, required

VERSION: Final = 1
ENDINGS: Final = {"stand": Ending.STAND, "wander": Ending.WANDER, "repeat": Ending.REPEAT}
OBJECT_KINDS: Final = {
    "table": (ObjectKind.TABLE,),
    "desk": (ObjectKind.TABLE, ObjectKind.LAPTOP),  # a table with a laptop, two objects as in SocNav2
    "plant": (ObjectKind.PLANT,),
}
DEFAULT_SIZES: Final = {"table": (0.9, 0.8), "desk": (0.9, 0.8), "plant": (0.18, 0.35)}  # m, as in SocNav2
MOST_OF_A_KIND: Final = 50
FASTEST: Final = 2.0  # m/s
LONGEST: Final = 600.0  # s
WALL_GAP: Final = 0.01  # m between the ends of two walls that meet

_NOTHING: Final = Amount(0.0, 0.0)
_TOP = ("version", "description", "room", "robot", "goal", "people", "objects", "interactions", "time_limit", "config")
_PERSON = ("name", "count", "at", "jitter", "heading", "does", "route", "speed", "delay", "then", "with")
_OF_A_ROUTE = ("does", "route", "speed", "delay", "then", "count")  # what a companion copies


def parse_scene(text: str, file: str) -> SceneFile:
    """Parse a scenario file's text. Raises `ConfigError` with one line naming the file and the field."""
    top = read_yaml(text, file)
    fields = top.fields(_TOP)
    version = required(fields, "version", top)
    if version.value != VERSION:
        raise version.refused(f"must be {VERSION}, the format that this version reads")
    scene = SceneFile(
        file=file,
        description=optional(fields, "description", Field.text, "").strip(),
        room=_room(required(fields, "room", top)),
        robot=_robot(required(fields, "robot", top)),
        goal=_goal(required(fields, "goal", top)),
        people=tuple(_person(each) for each in _items(fields, "people")),
        objects=tuple(_object(each) for each in _items(fields, "objects")),
        interactions=tuple(_interaction(each) for each in _items(fields, "interactions")),
        overrides=_overrides(fields),
    )
    _check_names(scene)
    return scene


def _items(fields: dict[str, Field], name: str) -> list[Field]:
    return fields[name].items() if name in fields else []


def _overrides(fields: dict[str, Field]) -> dict[str, Any]:
    overrides: dict[str, Any] = {}
    if "config" in fields:
        value = fields["config"].value
        if not isinstance(value, dict):
            raise fields["config"].refused("must be fields and their values")
        overrides |= value
    if "time_limit" in fields:
        if "time_limit" in overrides:
            raise fields["time_limit"].refused("must not stand under config too")
        overrides["time_limit"] = fields["time_limit"].number(0.1, LONGEST)
    return overrides


def _room(room: Field) -> RoomEntry:
    fields = room.fields(("size", "corners", "walls"))
    if len(fields) != 1:
        raise room.refused("must have one of size, corners and walls")
    if "size" in fields:
        length, breadth = fields["size"].pair("must be [length, breadth]")
        return RoomEntry(size=(length.amount(1.0, 100.0), breadth.amount(1.0, 100.0)))
    if "walls" in fields:
        return RoomEntry(_corners_of_walls(fields["walls"]))
    corners = tuple(_point(each) for each in fields["corners"].items())
    if len(corners) < 3:
        raise fields["corners"].refused("must be at least three points")
    return RoomEntry(corners)


def _corners_of_walls(walls: Field) -> tuple[tuple[Amount, Amount], ...]:
    lines = []
    for item in walls.items():
        numbers = [each.number() for each in item.items()]
        if len(numbers) != 4:
            raise item.refused("must be [x1, y1, x2, y2]")
        lines.append(numbers)
    if len(lines) < 3:
        raise walls.refused("must be at least three walls")
    for index, line in enumerate(lines):
        after = (index + 1) % len(lines)
        if math.dist(line[2:], lines[after][:2]) > WALL_GAP:
            raise ConfigError(
                f"{walls.file}: {walls.path} must close, but wall {index} ends at ({line[2]:g}, {line[3]:g}) and wall "
                f"{after} begins at ({lines[after][0]:g}, {lines[after][1]:g})"
            )
    return tuple((Amount(x, x), Amount(y, y)) for x, y, _, _ in lines)


def _point(point: Field) -> tuple[Amount, Amount]:
    x, y = point.pair("must be a point [x, y], each a number or a range [least, most]")
    return x.amount(), y.amount()


def _spot(fields: dict[str, Field], parent: Field) -> Spot:
    x, y = _point(required(fields, "at", parent))
    return Spot(x, y, optional(fields, "jitter", lambda each: each.number(0.0, 100.0), 0.0))


def _heading(heading: Field) -> Amount | str:
    return heading.value if isinstance(heading.value, str) else _angle(heading)


def _angle(angle: Field) -> Amount:
    return angle.amount(-2 * math.pi, 2 * math.pi)


def _name(fields: dict[str, Field]) -> str:
    return optional(fields, "name", Field.text, "")


def _robot(robot: Field) -> Entity:
    fields = robot.fields(("at", "jitter", "heading"))
    return Entity(robot.path, "", _spot(fields, robot), optional(fields, "heading", _heading, None))


def _goal(goal: Field) -> Entity:
    return Entity(goal.path, "", _spot(goal.fields(("at", "jitter")), goal), None)


def _person(person: Field) -> PersonEntry:
    fields = person.fields(_PERSON)
    companion = optional(fields, "with", Field.text, "")
    route = tuple(Spot(*_point(each)) for each in _items(fields, "route"))
    does = WALKS if route or companion else STANDS
    if "does" in fields:
        does = fields["does"].one_of((STANDS, WALKS, WANDERS))
    _check_walk(person, fields, does, bool(route))
    count = optional(fields, "count", lambda each: each.whole(0, MOST_OF_A_KIND), (1, 1))
    if count != (1, 1) and "name" in fields:
        raise fields["name"].refused("must be of a single person, without count")
    ending = optional(fields, "then", lambda each: each.one_of(ENDINGS), STANDS)
    return PersonEntry(
        place=person.path,
        name=_name(fields),
        spot=_spot(fields, person),
        heading=optional(fields, "heading", _heading, None),
        count=count,
        does=does,
        route=route,
        speed=fields["speed"].amount(0.1, FASTEST) if "speed" in fields else None,
        delay=optional(fields, "delay", lambda each: each.amount(0.0, LONGEST), _NOTHING),
        ending=ENDINGS[ending],
        companion=companion,
    )


def _check_walk(person: Field, fields: dict[str, Field], does: str, has_route: bool) -> None:
    """Refuse fields about walking for a person who does not walk or whose companion sets them."""
    if "with" in fields:
        for name in _OF_A_ROUTE:
            if name in fields:
                raise fields[name].refused("must be left to the one walked with")
        return
    if does == WALKS and not has_route:
        raise ConfigError(f"{person.file}: {person.path}.route is missing, who walks needs one")
    if does != WALKS and has_route:
        raise fields["route"].refused(f"needs somebody who walks, not one who does {does}")
    for name in ("delay", "then"):
        if name in fields and not has_route:
            raise fields[name].refused("needs a route")
    if "speed" in fields and does == STANDS:
        raise fields["speed"].refused("needs somebody who walks or wanders")


def _object(thing: Field) -> ObjectEntry:
    fields = thing.fields(("name", "kind", "at", "jitter", "heading", "size"))
    kind = required(fields, "kind", thing).one_of(OBJECT_KINDS)
    width, depth = (Amount(side, side) for side in DEFAULT_SIZES[kind])
    if "size" in fields:
        width, depth = (each.amount(0.05, 20.0) for each in fields["size"].pair("must be [width, depth]"))
    return ObjectEntry(
        place=thing.path,
        name=_name(fields),
        spot=_spot(fields, thing),
        heading=optional(fields, "heading", _angle, _NOTHING),
        kinds=OBJECT_KINDS[kind],
        size=(width, depth),
    )


def _interaction(interaction: Field) -> InteractionEntry:
    fields = interaction.fields(("between", "relation"))
    first, second = required(fields, "between", interaction).pair("must be two names")
    relation = fields["relation"].one_of(RELATIONS) if "relation" in fields else None
    return InteractionEntry(interaction.path, (first.text(), second.text()), relation)


def _check_names(scene: SceneFile) -> None:
    """Refuse names that are used twice, and names that are used but not defined."""
    known = {ROBOT, GOAL}
    for entity in (*scene.people, *scene.objects):
        if entity.name in known:
            raise ConfigError(f"{scene.file}: {entity.place}.name must be its own, got {entity.name!r} again")
        known |= {entity.name} - {""}
    for looking in (scene.robot, *scene.people):
        if isinstance(looking.heading, str) and looking.heading not in known - {looking.name}:
            _refuse_name(scene, f"{looking.place}.heading", looking.heading, known - {looking.name})
    leaders = {person.name for person in scene.people if person.route} - {""}
    for person in scene.people:
        if person.companion and person.companion not in leaders:
            _refuse_name(scene, f"{person.place}.with", person.companion, leaders)
    for interaction in scene.interactions:
        for name in interaction.between:
            if name not in known - {ROBOT, GOAL}:
                _refuse_name(scene, f"{interaction.place}.between", name, known - {ROBOT, GOAL})


def _refuse_name(scene: SceneFile, place: str, name: str, known: set[str]) -> None:
    named = ", ".join(sorted(known)) or "none: give people and objects a name"
    raise ConfigError(f"{scene.file}: {place} must name one of {named}; got {name!r}")
