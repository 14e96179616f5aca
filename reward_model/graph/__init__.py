"""Graphs of a scene's last three seconds, in the layout of the published network.

May import `base` and `scenes`. Modules load when one of their names is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from reward_model.base.lazy import lazy_attributes

if TYPE_CHECKING:
    from reward_model.graph.features import LAYOUT_VERSION, NodeKind, Relation
    from reward_model.graph.frame import FrameGraph
    from reward_model.graph.windows import (
        SceneGraph,
        frame_graph,
        mirrored_frame,
        scene_graph,
        select_window,
        sequence_frames,
        wall_segments,
    )

__all__ = [
    "LAYOUT_VERSION",
    "FrameGraph",
    "NodeKind",
    "Relation",
    "SceneGraph",
    "frame_graph",
    "mirrored_frame",
    "scene_graph",
    "select_window",
    "sequence_frames",
    "wall_segments",
]

__getattr__ = lazy_attributes(
    __name__,
    {"LAYOUT_VERSION": "features", "NodeKind": "features", "Relation": "features", "FrameGraph": "frame"}
    | dict.fromkeys(__all__[4:], "windows"),
)
