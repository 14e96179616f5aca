"""The floor of a scenario's room during placement: the bodies placed so far, and checks against overlap."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from reward_model.base.arrays import BoolArray, FloatArray
from socnav_env.geometry.distances import box_distance, boxes_of, inside, is_free, line_is_free, wall_distances
from socnav_env.layout import Room

TOUCHING: Final = 0.01  # m by which bodies that are side by side may overlap
OUTLINE_STEP: Final = 0.1  # m between the checked points of a box's outline
SMALLEST_AREA: Final = 1.0  # m^2


class UnfitError(Exception):
    """A draw of a scenario does not fit; the message gives the reason."""


class Floor:
    """All bodies placed so far, with their descriptions for error messages.

    Args:
        boxes: (num_boxes, 6) initial boxes, which may overlap each other
    """

    def __init__(self, room: Room, boxes: FloatArray | None = None) -> None:
        self.walls = room.walls
        self._discs = np.zeros((0, 3))
        self._boxes = np.zeros((0, 6)) if boxes is None else boxes
        self._disc_words: list[str] = []
        self._box_words = [f"object {index}" for index in range(len(self._boxes))]

    @property
    def boxes(self) -> FloatArray:
        """(num_boxes, 6) rows as in `geometry`."""
        return self._boxes

    def add_person(self, place: FloatArray, radius: float, words: str) -> None:
        """Place a person; raises `UnfitError` where they do not fit."""
        self.require_room(place, radius, words)
        self._discs = np.vstack([self._discs, [*place, radius]])
        self._disc_words.append(words)

    def add_box(self, pose: FloatArray, size: tuple[float, float], words: str) -> None:
        """Place an object; raises `UnfitError` where it does not fit."""
        box = boxes_of(pose[None], np.array([size]))[0]
        outline = _outline(box)
        if not all(inside(x, y, self.walls) for x, y in outline.tolist()):
            raise UnfitError(f"{words} must stand inside the room, got {_shown(pose)}")
        for other, name in zip(self._boxes, self._box_words, strict=True):
            apart = min(_least_distance(outline, other), _least_distance(_outline(other), box))
            if apart < -TOUCHING:
                raise UnfitError(f"{words} must not overlap {name}, got {_shown(pose)}")
        self._boxes = np.vstack([self._boxes, box])
        self._box_words.append(words)

    def require_room(self, place: FloatArray, radius: float, words: str, among_people: bool = True) -> None:
        """Raise `UnfitError` where a round body of this radius [m] overlaps something."""
        x, y = place.tolist()
        if not inside(x, y, self.walls):
            raise UnfitError(f"{words} must be inside the room, got {_shown(place)}")
        if wall_distances(x, y, self.walls).min() < radius - TOUCHING:
            raise UnfitError(f"{words} must be at least {radius:g} m from the walls, got {_shown(place)}")
        for box, name in zip(self._boxes, self._box_words, strict=True):
            if box_distance(x, y, box) < radius - TOUCHING:
                raise UnfitError(f"{words} must not overlap {name}, got {_shown(place)}")
        for disc, name in zip(self._discs if among_people else (), self._disc_words, strict=among_people):
            if math.hypot(x - disc[0], y - disc[1]) < radius + disc[2] - TOUCHING:
                raise UnfitError(f"{words} must not overlap {name}, got {_shown(place)}")

    def people(self, chosen: BoolArray) -> FloatArray:
        """(num_chosen, 3) x, y, radius of the chosen people, in the order of their placement."""
        return self._discs[chosen]

    def free_way(self, start: FloatArray, direction: FloatArray, longest: float, radius: float) -> float:
        """The distance [m] a body can go from `start` before a wall or an object blocks it, at most `longest` [m]."""
        nobody = self._discs[:0]
        reach = longest
        while reach > OUTLINE_STEP:
            end = start + reach * direction
            if is_free(end[0], end[1], radius, self.walls, nobody, self._boxes) and line_is_free(
                start, end, radius, self.walls, nobody, self._boxes
            ):
                return reach
            reach -= OUTLINE_STEP
        return 0.0


def ordered_corners(corners: FloatArray) -> FloatArray:
    """The corners of a room counter-clockwise; raises `UnfitError` where its walls cross or enclose too small an area.

    Args:
        corners: (num_corners, 2) [m]
    """
    walls = Room(corners).walls
    count = len(walls)
    for one in range(count):
        for other in range(one + 1, count):
            neighbours = other == one + 1 or (one == 0 and other == count - 1)
            if not neighbours and _cross(walls[one], walls[other]):
                raise UnfitError(f"room: walls must not cross, but walls {one} and {other} do")
    x, y = corners.T
    area = float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2
    if abs(area) < SMALLEST_AREA:
        raise UnfitError(f"room: must have at least {SMALLEST_AREA:g} m^2, got {abs(area):.2g}")
    return corners if area > 0 else np.ascontiguousarray(corners[::-1])


def _cross(one: FloatArray, other: FloatArray) -> bool:
    """Whether two walls have a point in common."""

    def side(wall: FloatArray, x: float, y: float) -> float:
        return float(np.sign((wall[2] - wall[0]) * (y - wall[1]) - (wall[3] - wall[1]) * (x - wall[0])))

    return (
        side(one, other[0], other[1]) != side(one, other[2], other[3])
        and side(other, one[0], one[1]) != side(other, one[2], one[3])
    )  # fmt: skip


def _outline(box: FloatArray) -> FloatArray:
    """(n, 2) points around a box, slightly inside it so that it may stand against a wall."""
    x, y, cosine, sine, half_width, half_depth = box.tolist()
    half_width, half_depth = half_width - TOUCHING / 2, half_depth - TOUCHING / 2
    across = np.linspace(-half_width, half_width, max(2, math.ceil(2 * half_width / OUTLINE_STEP)))
    along = np.linspace(-half_depth, half_depth, max(2, math.ceil(2 * half_depth / OUTLINE_STEP)))
    sides = [np.column_stack([across, np.full_like(across, depth)]) for depth in (-half_depth, half_depth)]
    sides += [np.column_stack([np.full_like(along, width), along]) for width in (-half_width, half_width)]
    points = np.vstack(sides)
    return np.asarray(points @ np.array([[cosine, sine], [-sine, cosine]]) + (x, y))


def _least_distance(points: FloatArray, box: FloatArray) -> float:
    return min(box_distance(x, y, box) for x, y in points.tolist())


def _shown(place: FloatArray) -> str:
    return f"({place[0]:.2f}, {place[1]:.2f})"
