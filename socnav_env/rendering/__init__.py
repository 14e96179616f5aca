"""Pictures of a scene, drawn with pygame: what `render_mode="rgb_array"` and `"human"` show.

The room is seen from above with the world's y axis pointing up the picture. Everything is drawn at twice
the size and scaled down, which smooths all edges. Works without a display.
"""

from __future__ import annotations

import os

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # pygame prints a greeting on import otherwise

from socnav_env.rendering.controls import Controls
from socnav_env.rendering.renderer import Renderer

__all__ = ["Controls", "Renderer"]
