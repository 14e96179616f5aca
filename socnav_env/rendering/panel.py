"""The strip below the room: the time, both scores, and how the episode ended."""

from __future__ import annotations

import pygame

from socnav_env.rendering.style import (
    FAINT_INK,
    GAUGE_BACK,
    INK,
    MARGIN,
    OUTCOME_COLORS,
    OUTCOME_WORDS,
    PANEL,
    PANEL_HEIGHT,
    ROBOT,
    SCORE_COLORS,
    SUPERSAMPLING,
    Color,
)
from socnav_env.rendering.view import SceneView


def draw_panel(surface: pygame.Surface, view: SceneView) -> None:
    """Draw the strip at the bottom: the time, both scores, and how the episode ended."""
    width, height = surface.get_size()
    unit = SUPERSAMPLING
    top = height - PANEL_HEIGHT * unit
    pygame.draw.rect(surface, PANEL, (0, top, width, PANEL_HEIGHT * unit))
    middle = top + PANEL_HEIGHT * unit // 2
    _write(surface, f"{view.time:.1f} s", 17, INK, (MARGIN * unit, middle - 10 * unit))
    _write(surface, f"of {view.time_limit:.0f} s", 11, FAINT_INK, (MARGIN * unit, middle + 11 * unit))
    if view.scores is not None:
        for name, score, y in zip(("Q1", "Q2"), view.scores[:2], (-11, 11), strict=True):
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
