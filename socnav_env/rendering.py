"""Pictures of a scene, drawn with pygame: what `render_mode="rgb_array"` and `"human"` show.

The room is seen from above with the world's y axis pointing up the picture. Everything is drawn at twice
the size and scaled down, which smooths all edges. Works without a display.
"""

from __future__ import annotations

import os
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from socnav_env.layout import FloatArray, ObjectKind
from socnav_env.views import SceneView

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # pygame prints a greeting on import otherwise
import pygame

DEFAULT_SIZE = 600  # pixels, width and height of a frame
SUPERSAMPLING = 2  # picture is drawn this many times larger, then scaled down
PANEL_HEIGHT = 58  # pixels, of the strip with the gauges below the room
MARGIN = 18  # pixels, between the room and the edge of the picture

Color = tuple[int, int, int]
BACKGROUND: Color = (226, 229, 233)
FLOOR: Color = (252, 251, 248)
GRID: Color = (238, 237, 232)
WALL: Color = (62, 70, 82)
INK: Color = (40, 46, 56)
FAINT_INK: Color = (128, 136, 148)
PANEL: Color = (255, 255, 255)
GOAL: Color = (46, 160, 98)
GOAL_DISC: Color = (205, 238, 217)
ROBOT: Color = (214, 60, 62)
ROBOT_DARK: Color = (140, 30, 36)
TRAIL: Color = (236, 158, 152)
WALKING: Color = (58, 124, 204)
STANDING: Color = (130, 88, 184)
HAIR: Color = (66, 52, 46)
INTERACTION: Color = (238, 158, 42)
TABLE: Color = (205, 170, 125)
TABLE_EDGE: Color = (158, 122, 80)
LAPTOP: Color = (70, 78, 90)
SCREEN: Color = (150, 200, 235)
POT: Color = (186, 110, 74)
LEAF: Color = (70, 150, 80)
LEAF_DARK: Color = (48, 116, 62)
GAUGE_BACK: Color = (228, 230, 234)
SCORE_COLORS: tuple[Color, ...] = ((205, 52, 52), (232, 130, 50), (236, 190, 60), (140, 190, 80), (44, 158, 94))
OUTCOME_COLORS: dict[str, Color] = {"arrived": GOAL, "timeout": FAINT_INK}  # any other one is a contact
OUTCOME_WORDS = {
    "arrived": "arrived",
    "timeout": "out of time",
    "collision_person": "touched a person",
    "collision_object": "touched an object",
    "collision_wall": "touched a wall",
}


class Renderer:
    """Draws scenes, into arrays or into a window.

    size: width and height of a frame in pixels
    """

    def __init__(self, size: int = DEFAULT_SIZE) -> None:
        pygame.font.init()
        self._size = size
        self._canvas = pygame.Surface((size * SUPERSAMPLING, size * SUPERSAMPLING))
        self._floor = self._canvas.copy()  # the room drawn last, most often the next one too
        self._corners = np.zeros((0, 2))
        self._window: pygame.Surface | None = None
        self._clock = pygame.time.Clock()

    def draw(self, view: SceneView) -> NDArray[np.uint8]:
        """Draw the scene and return the picture, uint8 (height, width, 3)."""
        pixels = bytearray(pygame.image.tobytes(self._picture(view), "RGB"))
        return np.frombuffer(pixels, dtype=np.uint8).reshape(self._size, self._size, 3)

    def show(self, view: SceneView, frames_per_second: float) -> None:
        """Draw the scene into a window, opening it the first time, and wait until the next frame is due."""
        if self._window is None:
            pygame.display.init()
            pygame.display.set_caption("SocNav2-v0")
            self._window = pygame.display.set_mode((self._size, self._size))
        pygame.event.pump()
        self._window.blit(self._picture(view), (0, 0))
        pygame.display.flip()
        self._clock.tick(frames_per_second)

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            pygame.display.quit()
            self._window = None

    def _picture(self, view: SceneView) -> pygame.Surface:
        if not np.array_equal(self._corners, view.corners):
            self._floor.fill(BACKGROUND)
            _Painter(self._floor, view.corners).room(view.corners)
            self._corners = view.corners.copy()
        self._canvas.blit(self._floor, (0, 0))
        painter = _Painter(self._canvas, view.corners)
        painter.goal(view)
        painter.interactions(view.interaction_lines)
        for pose, size, kind in zip(view.object_poses, view.object_sizes, view.object_kinds, strict=True):
            painter.thing(pose, size, ObjectKind(kind))
        painter.trail(view)
        for pose, walks in zip(view.people_poses, view.people_walk, strict=True):
            painter.person(pose, view.people_radius, WALKING if walks else STANDING)
        painter.robot(view.robot_pose, view.robot_radius)
        _draw_panel(self._canvas, view)
        return pygame.transform.smoothscale(self._canvas, (self._size, self._size))


class _Painter:
    """Draws things at world coordinates on a surface into which the room just fits, above the panel."""

    def __init__(self, surface: pygame.Surface, corners: FloatArray) -> None:
        self.surface = surface
        width, height = surface.get_size()
        height -= PANEL_HEIGHT * SUPERSAMPLING
        low, high = corners.min(axis=0), corners.max(axis=0)
        room = np.array([width, height]) - 2 * MARGIN * SUPERSAMPLING
        self.scale = float((room / (high - low)).min())  # pixels per metre
        self.origin = np.array([width, height]) / 2 - self.scale * np.array([1, -1]) * (low + high) / 2

    def pixels(self, points: FloatArray) -> FloatArray:
        """World points (n, 2) [m] as positions on the surface."""
        return np.asarray(points * np.array([self.scale, -self.scale]) + self.origin)

    def room(self, corners: FloatArray) -> None:
        outline = self.pixels(corners)
        pygame.draw.polygon(self.surface, FLOOR, outline.tolist())
        floor = pygame.mask.from_threshold(self.surface, FLOOR, (1, 1, 1, 255))
        tiles = self.surface.copy()
        low, high = np.ceil(corners.min(axis=0)), np.floor(corners.max(axis=0))
        for x in np.arange(low[0], high[0] + 1):
            self._grid_line(tiles, np.array([[x, corners[:, 1].min()], [x, corners[:, 1].max()]]))
        for y in np.arange(low[1], high[1] + 1):
            self._grid_line(tiles, np.array([[corners[:, 0].min(), y], [corners[:, 0].max(), y]]))
        floor.to_surface(self.surface, setsurface=tiles, unsetcolor=None)
        width = 5 * SUPERSAMPLING
        for start, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
            _thick_line(self.surface, WALL, start, end, width)

    def _grid_line(self, surface: pygame.Surface, ends: FloatArray) -> None:
        start, end = self.pixels(ends).tolist()
        pygame.draw.line(surface, GRID, start, end, SUPERSAMPLING)

    def goal(self, view: SceneView) -> None:
        center = self.pixels(view.goal)
        middle = center.tolist()
        radius = max(view.arrival_radius * self.scale, 5 * SUPERSAMPLING)
        pygame.draw.circle(self.surface, GOAL_DISC, middle, radius)
        pygame.draw.circle(self.surface, GOAL, middle, radius, 2 * SUPERSAMPLING)
        angles = np.pi / 2 + np.arange(10) * np.pi / 5
        lengths = np.where(np.arange(10) % 2 == 0, 0.7, 0.3) * radius
        star = center + np.column_stack([np.cos(angles), -np.sin(angles)]) * lengths[:, None]
        pygame.draw.polygon(self.surface, GOAL, star.tolist())

    def interactions(self, lines: FloatArray) -> None:
        for line in lines.reshape(-1, 2, 2):
            start, end = self.pixels(line)
            length = float(np.hypot(*(end - start)))
            dots = max(int(length / (7 * SUPERSAMPLING)), 1)
            for dot in np.linspace(start, end, dots + 1).tolist():
                pygame.draw.circle(self.surface, INTERACTION, dot, 2 * SUPERSAMPLING)

    def trail(self, view: SceneView) -> None:
        points = self.pixels(view.trail)
        for start, end in pairwise(points):
            _thick_line(self.surface, TRAIL, start, end, 2 * SUPERSAMPLING)
        for pose in view.trail_marks:
            self._polygon(ROBOT_DARK, pose, _circle(view.robot_radius), SUPERSAMPLING)
            self._polygon(ROBOT_DARK, pose, view.robot_radius * np.array([[0.0, 0.0], [1.0, 0.0]]), SUPERSAMPLING)

    def thing(self, pose: FloatArray, size: FloatArray, kind: ObjectKind) -> None:
        half = np.asarray(size) / 2
        if kind is ObjectKind.TABLE:
            self._polygon(TABLE_EDGE, pose, _box(half))
            self._polygon(TABLE, pose, _box(half - 0.03))
        elif kind is ObjectKind.LAPTOP:
            # The recorded size is the table's; the machine on it is drawn as large as one is.
            self._polygon(LAPTOP, pose, _box(np.array([0.13, 0.17])))
            self._polygon(SCREEN, pose, _box(np.array([0.04, 0.15])) - [0.10, 0.0])
        else:
            self._polygon(POT, pose, _box(half))
            leaves = _circle(0.08) * [1.0, 0.5] + [0.09, 0.0]
            for index in range(7):
                turned = np.array([*pose[:2], pose[2] + index * 2 * np.pi / 7])
                self._polygon(LEAF if index % 2 else LEAF_DARK, turned, leaves)

    def person(self, pose: FloatArray, radius: float, color: Color) -> None:
        dark: Color = (int(color[0] * 0.7), int(color[1] * 0.7), int(color[2] * 0.7))
        feet = _circle(0.30 * radius) * [1.5, 0.8]
        for side in (-0.45, 0.45):
            self._polygon(INK, pose, feet + np.array([0.42, side]) * radius)
        self._polygon(dark, pose, _circle(radius) * [0.68, 1.0])
        self._polygon(color, pose, _circle(radius * 0.9) * [0.62, 1.0])
        nose = np.array([[0.42, -0.16], [0.72, 0.0], [0.42, 0.16]]) * radius
        self._polygon((240, 200, 170), pose, nose)
        self._polygon((240, 200, 170), pose, _circle(0.5 * radius))
        self._polygon(HAIR, pose, _circle(0.47 * radius) * [0.8, 1.0] - [0.10 * radius, 0.0])

    def robot(self, pose: FloatArray, radius: float) -> None:
        wheel = _box(np.array([0.38, 0.13]) * radius)
        self._polygon(ROBOT_DARK, pose, _circle(radius))
        self._polygon(ROBOT, pose, _circle(radius * 0.88))
        for side in (-0.8, 0.8):
            self._polygon(INK, pose, wheel + np.array([0.0, side * radius]))
        arrow = np.array([[0.75, 0.0], [-0.35, 0.48], [-0.12, 0.0], [-0.35, -0.48]]) * radius
        self._polygon((255, 255, 255), pose, arrow)

    def _polygon(self, color: Color, pose: FloatArray, points: FloatArray, width: int = 0) -> None:
        """Draw points (n, 2) [m] given in the frame of a pose."""
        cosine, sine = np.cos(pose[2]), np.sin(pose[2])
        turned = points @ np.array([[cosine, sine], [-sine, cosine]])
        outline = self.pixels(turned + pose[:2]).tolist()
        if len(outline) == 2:
            pygame.draw.line(self.surface, color, outline[0], outline[1], width)
        else:
            pygame.draw.polygon(self.surface, color, outline, width)


def _draw_panel(surface: pygame.Surface, view: SceneView) -> None:
    """Draw the strip at the bottom: the time, both scores, and how the episode ended."""
    width, height = surface.get_size()
    unit = SUPERSAMPLING
    top = height - PANEL_HEIGHT * unit
    pygame.draw.rect(surface, PANEL, (0, top, width, PANEL_HEIGHT * unit))
    middle = top + PANEL_HEIGHT * unit // 2
    _write(surface, f"{view.time:.1f} s", 17, INK, (MARGIN * unit, middle - 10 * unit))
    _write(surface, f"of {view.time_limit:.0f} s", 11, FAINT_INK, (MARGIN * unit, middle + 11 * unit))
    if view.scores is not None:
        for name, score, y in zip(("Q1", "Q2"), view.scores, (-11, 11), strict=True):
            _draw_gauge(surface, name, score, 110 * unit, middle + y * unit)
    if view.outcome is not None:
        color = OUTCOME_COLORS.get(view.outcome, ROBOT)
        text = OUTCOME_WORDS.get(view.outcome, view.outcome)
        badge = pygame.Rect(width - (MARGIN + 170) * unit, middle - 15 * unit, 170 * unit, 30 * unit)
        pygame.draw.rect(surface, color, badge, border_radius=15 * unit)
        _write(surface, text, 15, (255, 255, 255), badge.center, centered=True)


def _draw_gauge(surface: pygame.Surface, name: str, score: float, left: int, middle: int) -> None:
    unit = SUPERSAMPLING
    length, thickness = 200 * unit, 12 * unit
    share = min(max(score, 0.0), 1.0)
    bar = pygame.Rect(left + 28 * unit, middle - thickness // 2, length, thickness)
    pygame.draw.rect(surface, GAUGE_BACK, bar, border_radius=thickness // 2)
    filled = bar.copy()
    filled.width = max(int(length * share), thickness)
    color = SCORE_COLORS[min(int(share * len(SCORE_COLORS)), len(SCORE_COLORS) - 1)]
    pygame.draw.rect(surface, color, filled, border_radius=thickness // 2)
    _write(surface, name, 13, INK, (left, middle))
    _write(surface, f"{score:.2f}", 13, INK, (bar.right + 8 * unit, middle))


def _write(
    surface: pygame.Surface,
    text: str,
    size: int,
    color: Color,
    place: tuple[int, int],
    centered: bool = False,
) -> None:
    """Write text, its left end (or its middle) at a place, vertically centred."""
    letters = pygame.font.Font(None, size * SUPERSAMPLING * 4 // 3).render(text, True, color)
    box = letters.get_rect(center=place) if centered else letters.get_rect(midleft=place)
    surface.blit(letters, box)


def _thick_line(surface: pygame.Surface, color: Color, start: FloatArray, end: FloatArray, width: int) -> None:
    """Draw a line with round ends, of the same thickness at any angle (pygame's own is not)."""
    along = end - start
    length = float(np.hypot(*along))
    if length > 0:
        across = np.array([-along[1], along[0]]) / length * width / 2
        corners = np.array([start + across, end + across, end - across, start - across])
        pygame.draw.polygon(surface, color, corners.tolist())
    for point in (start, end):
        pygame.draw.circle(surface, color, point.tolist(), width / 2)


def _circle(radius: float, corners: int = 28) -> FloatArray:
    angles = np.arange(corners) * 2 * np.pi / corners
    return np.asarray(radius * np.column_stack([np.cos(angles), np.sin(angles)]))


def _box(half: FloatArray) -> FloatArray:
    return np.asarray(np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * half)
