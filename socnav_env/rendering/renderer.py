"""Renderer of whole scenes, into arrays or into a window."""

from __future__ import annotations

import numpy as np
import pygame
from numpy.typing import NDArray

from socnav_env.layout import ObjectKind
from socnav_env.rendering.controls import Controls
from socnav_env.rendering.painter import Painter
from socnav_env.rendering.panel import draw_panel
from socnav_env.rendering.style import (
    BACKGROUND,
    DEFAULT_SIZE,
    STANDING,
    SUPERSAMPLING,
    WALKING,
)
from socnav_env.rendering.view import SceneView


class Renderer:
    """Draws scenes, into arrays or into a window.

    controls: keyboard and joystick input of the window

    Args:
        size: width and height of a frame in pixels
    """

    def __init__(self, size: int = DEFAULT_SIZE) -> None:
        pygame.font.init()
        self._size = size
        self._canvas = pygame.Surface((size * SUPERSAMPLING, size * SUPERSAMPLING))
        self._floor = self._canvas.copy()  # the room drawn last, most often also the next one
        self._corners = np.zeros((0, 2))
        self._window: pygame.Surface | None = None
        self._clock = pygame.time.Clock()
        self.controls = Controls()

    def draw(self, view: SceneView) -> NDArray[np.uint8]:
        """Draw the scene and return the picture, uint8 (height, width, 3)."""
        pixels = bytearray(pygame.image.tobytes(self._picture(view), "RGB"))
        return np.frombuffer(pixels, dtype=np.uint8).reshape(self._size, self._size, 3)

    def show(self, view: SceneView, frames_per_second: float) -> None:
        """Draw the scene into a window, opening it the first time, and wait until the next frame is due."""
        if self._window is None:
            pygame.display.init()
            pygame.joystick.init()
            pygame.display.set_caption("SocNav2-v0")
            self._window = pygame.display.set_mode((self._size, self._size))
        self.controls.listen()
        self._window.blit(self._picture(view), (0, 0))
        pygame.display.flip()
        self._clock.tick(frames_per_second)

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            pygame.joystick.quit()
            pygame.display.quit()
            self._window = None

    def _picture(self, view: SceneView) -> pygame.Surface:
        if not np.array_equal(self._corners, view.corners):
            self._floor.fill(BACKGROUND)
            Painter(self._floor, view.corners).room(view.corners)
            self._corners = view.corners.copy()
        self._canvas.blit(self._floor, (0, 0))
        painter = Painter(self._canvas, view.corners)
        if view.heat is not None:
            painter.heat(view.heat, view.corners)
        painter.goal(view)
        if view.rings:
            painter.rings(view.people_poses)
        painter.interactions(view.interaction_lines)
        for pose, size, kind in zip(view.object_poses, view.object_sizes, view.object_kinds, strict=True):
            painter.thing(pose, size, ObjectKind(kind))
        painter.trail(view)
        for pose, walks in zip(view.people_poses, view.people_walk, strict=True):
            painter.person(pose, view.people_radius, WALKING if walks else STANDING)
        painter.robot(view.robot_pose, view.robot_radius)
        draw_panel(self._canvas, view)
        return pygame.transform.smoothscale(self._canvas, (self._size, self._size))
