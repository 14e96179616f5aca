"""Drawing of everything in the room."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pygame
from numpy.typing import NDArray

from reward_model.base.arrays import FloatArray
from socnav_env.layout import ObjectKind
from socnav_env.rendering.style import (
    FLOOR,
    GOAL,
    GOAL_DISC,
    GRID,
    HAIR,
    HEAT_OPACITY,
    INK,
    INTERACTION,
    LAPTOP,
    LEAF,
    LEAF_DARK,
    MARGIN,
    PANEL_HEIGHT,
    POT,
    RING,
    RINGS,
    ROBOT,
    ROBOT_DARK,
    SCORE_COLORS,
    SCREEN,
    SUPERSAMPLING,
    TABLE,
    TABLE_EDGE,
    TRAIL,
    WALL,
    Color,
)
from socnav_env.rendering.view import HeatOverlay, SceneView


class Painter:
    """Draws at world coordinates on a surface, scaled so that the room just fits above the panel."""

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
        """Draw the floor with a metre grid, and the walls."""
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
        self._walls(outline)

    def heat(self, heat: HeatOverlay, corners: FloatArray) -> None:
        """Draw the heatmap of scores over the floor."""
        outline, shape = self.pixels(corners), self.surface.get_size()
        low, high = self.pixels(np.array([heat.low, heat.high]))
        cells = pygame.surfarray.make_surface(_heat_colors(heat.scores)[:, ::-1])  # its rows go down
        scaled = pygame.transform.smoothscale(cells, (round(high[0] - low[0]), round(low[1] - high[1])))
        layer = pygame.Surface(shape, pygame.SRCALPHA)
        layer.blit(scaled, (round(low[0]), round(high[1])))
        stencil = pygame.Surface(shape, pygame.SRCALPHA)
        pygame.draw.polygon(stencil, (255, 255, 255, HEAT_OPACITY), outline.tolist())
        layer.blit(stencil, (0, 0), special_flags=pygame.BLEND_RGBA_MIN)
        self.surface.blit(layer, (0, 0))
        self._walls(outline)

    def rings(self, people_poses: FloatArray) -> None:
        """Draw everyone's intimate and personal space."""
        for center in self.pixels(people_poses[:, :2]).tolist():
            for radius in RINGS:
                pygame.draw.circle(self.surface, RING, center, radius * self.scale, SUPERSAMPLING)

    def _walls(self, outline: FloatArray) -> None:
        for start, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
            _thick_line(self.surface, WALL, start, end, 5 * SUPERSAMPLING)

    def _grid_line(self, surface: pygame.Surface, ends: FloatArray) -> None:
        start, end = self.pixels(ends).tolist()
        pygame.draw.line(surface, GRID, start, end, SUPERSAMPLING)

    def goal(self, view: SceneView) -> None:
        """Draw the goal and the circle in which it counts as reached."""
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
        """Draw dotted lines between those who interact."""
        for line in lines.reshape(-1, 2, 2):
            start, end = self.pixels(line)
            length = float(np.hypot(*(end - start)))
            dots = max(int(length / (7 * SUPERSAMPLING)), 1)
            for dot in np.linspace(start, end, dots + 1).tolist():
                pygame.draw.circle(self.surface, INTERACTION, dot, 2 * SUPERSAMPLING)

    def trail(self, view: SceneView) -> None:
        """Draw the robot's path, and its poses in the frames that are scored."""
        points = self.pixels(view.trail)
        for start, end in pairwise(points):
            _thick_line(self.surface, TRAIL, start, end, 2 * SUPERSAMPLING)
        for pose in view.trail_marks:
            self._polygon(ROBOT_DARK, pose, _circle(view.robot_radius), SUPERSAMPLING)
            self._polygon(ROBOT_DARK, pose, view.robot_radius * np.array([[0.0, 0.0], [1.0, 0.0]]), SUPERSAMPLING)

    def thing(self, pose: FloatArray, size: FloatArray, kind: ObjectKind) -> None:
        """Draw an object."""
        half = np.asarray(size) / 2
        if kind is ObjectKind.TABLE:
            self._polygon(TABLE_EDGE, pose, _box(half))
            self._polygon(TABLE, pose, _box(half - 0.03))
        elif kind is ObjectKind.LAPTOP:
            # The recorded size is the table's; the laptop is drawn at a typical size.
            self._polygon(LAPTOP, pose, _box(np.array([0.13, 0.17])))
            self._polygon(SCREEN, pose, _box(np.array([0.04, 0.15])) - [0.10, 0.0])
        else:
            self._polygon(POT, pose, _box(half))
            leaves = _circle(0.08) * [1.0, 0.5] + [0.09, 0.0]
            for index in range(7):
                turned = np.array([*pose[:2], pose[2] + index * 2 * np.pi / 7])
                self._polygon(LEAF if index % 2 else LEAF_DARK, turned, leaves)

    def person(self, pose: FloatArray, radius: float, color: Color) -> None:
        """Draw a person, nose and feet to the front."""
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
        """Draw the robot with an arrow to its front."""
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


def _heat_colors(scores: FloatArray) -> NDArray[np.uint8]:
    """Colours (num_x, num_y, 3) from red for 0 to green for 1; a cell without a score has the nearest one's."""
    filled = scores.copy()
    known = np.argwhere(~np.isnan(scores))
    for cell in np.argwhere(np.isnan(scores)):
        nearest = known[np.argmin(((known - cell) ** 2).sum(axis=1))]
        filled[tuple(cell)] = scores[tuple(nearest)]
    steps = np.linspace(0.0, 1.0, len(SCORE_COLORS))
    channels = [np.interp(filled, steps, channel) for channel in zip(*SCORE_COLORS, strict=True)]
    return np.stack(channels, axis=-1).astype(np.uint8)
