"""Rendering of scenes with pygame, for `render_mode="rgb_array"` and `"human"`.

The room is seen from above with the world's y axis pointing up the picture. Everything is drawn at twice
the size and scaled down, which smooths all edges. Works without a display.

May import `trajectories` and what that is built of. pygame is loaded with `Renderer` and `Controls`, not before.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from reward_model.base.lazy import lazy_attributes

if TYPE_CHECKING:
    from socnav_env.rendering.controls import Controls
    from socnav_env.rendering.renderer import Renderer

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # pygame prints a greeting on import otherwise

__all__ = ["Controls", "Renderer"]

__getattr__ = lazy_attributes(__name__, {"Controls": "controls", "Renderer": "renderer"})
