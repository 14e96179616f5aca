"""Pictures of heatmaps, after those of Bachiller et al. 2021: the room from above, the robot heading up.

Scores near 0 are red, all others a tone of grey up to white for 1. People are blue circles with a line along their
heading, objects green rectangles, the goal a wide green ring, interactions red lines. The dashed axes cross at the
robot's recorded position.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon

from reward_model.analysis.heatmap import ACTIONS, Heatmap
from reward_model.base.arrays import FloatArray
from reward_model.scenes.poses import placed_at
from reward_model.scenes.scene import Snapshot

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Question = Literal["q1", "q2"]

RECORDED: Final = "as recorded"
DOTS_PER_INCH: Final = 100
PANEL: Final = 3.0  # inches, width and height of one map
MARGIN: Final = 1.0  # inches, right of the maps, for the scale of scores

PERSON_RADIUS: Final = 0.25  # m, half of a pair of shoulders
GOAL_RADIUS: Final = 0.3  # m

# The lowest scores in red; the step to grey is between "unacceptable" (0) and "undesirable" (0.2).
_COLORS: Final = LinearSegmentedColormap.from_list(
    "acceptance", [(0.0, "#e0201b"), (0.1, "#9c2320"), (0.15, "#3a2a2a"), (0.2, "#3c3c3c"), (1.0, "#ffffff")]
)
_SCALE: Final = ScalarMappable(Normalize(0, 1), _COLORS)
_QUESTIONS: Final = {"q1": "Q1", "q2": "Q2"}
_BLUE, _GREEN, _RED, _INK = "#2468c8", "#1f9d45", "#e02020", "#404040"


def draw_heatmaps(
    snapshot: Snapshot, heatmaps: Mapping[str, Heatmap], questions: Sequence[Question], title: str
) -> bytes:
    """A PNG of maps beside one another, a panel for each map and question.

    Args:
        snapshot: the scene's newest one
        heatmaps: by `RECORDED` and the names of `ACTIONS`; those of all actions have the paper's order, turns above
            drives
    """
    rows = _layout(heatmaps, questions)
    size = (len(rows[0]) * PANEL + MARGIN, len(rows) * PANEL)
    figure = Figure(figsize=size, dpi=DOTS_PER_INCH, layout="compressed")
    figure.suptitle(title, fontsize=10)
    grid = figure.subplots(len(rows), len(rows[0]), squeeze=False)
    for axes, panel in zip(grid.flat, [panel for row in rows for panel in row], strict=True):
        if panel is None:
            _draw_legend(axes)
            continue
        question, name = panel
        _draw_scores(axes, heatmaps[name], question)
        draw_scene(axes, snapshot)
        axes.set_title(f"{_QUESTIONS[question]}, {name}", fontsize=9)
    scale = figure.colorbar(_SCALE, ax=grid, shrink=0.6, aspect=40 if len(rows) > 1 else 20)
    scale.ax.set_title("score", fontsize=8)
    scale.ax.tick_params(labelsize=7)
    content = io.BytesIO()
    figure.savefig(content, format="png")
    return content.getvalue()


def _layout(heatmaps: Mapping[str, Heatmap], questions: Sequence[Question]) -> list[list[tuple[Question, str] | None]]:
    """The rows of panels; None is the panel of the legend."""
    if set(heatmaps) != {RECORDED, *ACTIONS}:
        return [[(question, name) for question in questions for name in heatmaps]]
    turns, drives = list(ACTIONS)[:3], list(ACTIONS)[3:]
    rows: list[list[tuple[Question, str] | None]] = []
    for question in questions:
        rows.append([(question, name) for name in (RECORDED, *turns)])
        rows.append([None, *((question, name) for name in drives)])
    return rows


def _draw_scores(axes: Axes, heatmap: Heatmap, question: Question) -> None:
    scores = heatmap.scores[..., 0 if question == "q1" else 1]
    shown = np.ma.masked_where(~heatmap.inside, scores)
    left, forward = _edges(heatmap.y), _edges(heatmap.x)
    axes.pcolormesh(-left, forward, shown, cmap=_COLORS, vmin=0, vmax=1, rasterized=True)
    axes.set_aspect("equal")
    margin = 0.2  # m
    axes.set_xlim(-left[-1] - margin, -left[0] + margin)
    axes.set_ylim(forward[0] - margin, forward[-1] + margin)
    axes.tick_params(labelsize=7, length=2)
    axes.set_xlabel("right [m]", fontsize=7, labelpad=1)
    axes.set_ylabel("forward [m]", fontsize=7, labelpad=1)


def _edges(centres: FloatArray) -> FloatArray:
    """The edges of cells of one size around these centres."""
    size = centres[1] - centres[0] if len(centres) > 1 else 1.0
    return np.append(centres - size / 2, centres[-1] + size / 2)


def draw_scene(axes: Axes, snapshot: Snapshot) -> None:
    """Draw a scene's people, objects, goal, walls and interactions: the robot's right is right, its front is up."""
    people, objects = snapshot.people, snapshot.objects
    axes.axhline(0, color=_INK, linewidth=0.6, linestyle=(0, (6, 4)))
    axes.axvline(0, color=_INK, linewidth=0.6, linestyle=(0, (6, 4)))
    for x1, y1, x2, y2 in snapshot.walls.tolist():
        axes.add_line(Line2D((-y1, -y2), (x1, x2), color=_INK, linewidth=1.5))
    for pose, size in zip(objects.poses, objects.sizes, strict=True):
        corners = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]]) * np.array([*size / 2, 0])
        axes.add_patch(Polygon(_on_paper(placed_at(pose, corners)), fill=False, edgecolor=_GREEN, linewidth=1.5))
    axes.add_patch(
        Circle((-snapshot.goal[1], snapshot.goal[0]), GOAL_RADIUS, fill=False, edgecolor=_GREEN, linewidth=4)
    )
    places = {
        identity: _on_paper(pose)
        for entities in (people, objects)
        for identity, pose in zip(entities.ids.tolist(), entities.poses, strict=True)
    }
    for source, target in snapshot.interactions.pairs.tolist():
        axes.add_line(Line2D(*np.array([places[source], places[target]]).T, color=_RED, linewidth=1.5))
    for pose in people.poses:
        nose = placed_at(pose, np.array([PERSON_RADIUS, 0.0, 0.0]))
        axes.add_patch(Circle((-pose[1], pose[0]), PERSON_RADIUS, fill=False, edgecolor=_BLUE, linewidth=1.5))
        axes.add_line(Line2D(*np.array([_on_paper(pose), _on_paper(nose)]).T, color=_BLUE, linewidth=1.5))


def _on_paper(points: FloatArray) -> FloatArray:
    """Points or poses of the robot's frame, as right and up (..., 2)."""
    return np.stack([-points[..., 1], points[..., 0]], axis=-1)


def _draw_legend(axes: Axes) -> None:
    axes.axis("off")
    handles = [
        Circle((0, 0), fill=False, edgecolor=_BLUE, linewidth=1.5, label="person"),
        Circle((0, 0), fill=False, edgecolor=_GREEN, linewidth=4, label="goal"),
        Polygon(np.zeros((4, 2)), fill=False, edgecolor=_GREEN, linewidth=1.5, label="object"),
        Line2D([], [], color=_RED, label="interaction"),
        Line2D([], [], color=_INK, linestyle="--", linewidth=0.8, label="axes of the robot\nas recorded"),
    ]
    axes.legend(handles=handles, loc="center", frameon=False, fontsize=8)
