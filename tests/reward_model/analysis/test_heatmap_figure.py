import io

import numpy as np
import pytest
from PIL import Image

from reward_model.analysis.heatmap import ACTIONS, Heatmap
from reward_model.analysis.heatmap_figure import DOTS_PER_INCH, MARGIN, PANEL, RECORDED, draw_heatmaps
from reward_model.analysis.synthetic_scenes import Person, SyntheticScene, Thing

SCENE = SyntheticScene(
    (2.0, -2.0), people=[Person(1.0, 1.0)], objects=[Thing(-1.0, -1.0, 0.5, 0.8, 0.6)], interactions=[(1, 2)]
)


def flat_map(score: float) -> Heatmap:
    """Both questions the same everywhere; the room's hindmost row is outside."""
    line = np.array([-3.0, 0.0, 3.0])
    inside = np.array([[False] * 3, [True] * 3, [True] * 3])
    return Heatmap(line, line, np.full((3, 3, 2), score, dtype=np.float32), inside)


def decoded(content: bytes) -> np.ndarray:
    with Image.open(io.BytesIO(content)) as image:
        assert image.format == "PNG"
        return np.asarray(image.convert("RGB")).astype(int)


def share_of(picture: np.ndarray, color: tuple[int, int, int]) -> float:
    return float((np.abs(picture - color).max(axis=-1) <= 2).mean())


@pytest.mark.parametrize(
    ("names", "questions", "columns", "rows"),
    [
        ([RECORDED], ("q1",), 1, 1),
        ([RECORDED], ("q1", "q2"), 2, 1),
        ([RECORDED, *ACTIONS], ("q2",), 4, 2),
        ([RECORDED, *ACTIONS], ("q1", "q2"), 4, 4),
    ],
)
def test_the_picture_has_a_panel_for_each_map_and_question(names, questions, columns, rows):
    maps = {name: flat_map(1.0) for name in names}
    picture = decoded(draw_heatmaps(SCENE.sequence().last, maps, questions, "title"))
    width, height = (columns * PANEL + MARGIN) * DOTS_PER_INCH, rows * PANEL * DOTS_PER_INCH
    assert picture.shape == (height, width, 3)


def test_low_scores_are_red_others_grey_and_the_outside_is_left_white():
    empty = SyntheticScene((2.0, -2.0)).sequence().last
    low = decoded(draw_heatmaps(empty, {RECORDED: flat_map(0.0)}, ("q1",), ""))
    middle = decoded(draw_heatmaps(empty, {RECORDED: flat_map(0.6)}, ("q1",), ""))
    red, grey = (224, 32, 27), (157, 157, 157)
    assert share_of(low, red) > 0.2
    assert share_of(low, grey) < 0.01
    assert share_of(middle, grey) > 0.2
    assert share_of(middle, red) < 0.01
    upper, lower = np.array_split(low, 2)
    assert share_of(upper, red) > 2 * share_of(lower, red)


def test_people_objects_goal_and_interactions_have_their_colors():
    maps = {RECORDED: flat_map(1.0)}
    everything = decoded(draw_heatmaps(SCENE.sequence().last, maps, ("q1",), ""))
    bare = decoded(draw_heatmaps(SyntheticScene((2.0, -2.0)).sequence().last, maps, ("q1",), ""))
    blue, green = (36, 104, 200), (31, 157, 69)
    assert share_of(everything, blue) > 0
    assert share_of(bare, blue) == 0
    assert share_of(everything, green) > share_of(bare, green) > 0
