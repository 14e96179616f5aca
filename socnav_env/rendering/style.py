"""Sizes and colours of pictures."""

from __future__ import annotations

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
RING: Color = (122, 62, 110)
HEAT_OPACITY = 165  # of 255
RINGS = (0.45, 1.2)  # m around a person's centre: intimate and personal space (Hall 1966)
