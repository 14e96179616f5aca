import gymnasium as gym
import numpy as np
import pygame
import pytest

from reward_model.scenes.scene import Scores
from socnav_env.layout import ObjectKind
from socnav_env.rendering import Renderer
from socnav_env.rendering.style import FLOOR, GOAL, INTERACTION, PANEL, PANEL_HEIGHT, ROBOT, TRAIL, WALKING, WALL
from socnav_env.rendering.view import SceneView

# A room of 10 x 10 m drawn into 600 x 542 pixels with a margin of 18: 50.6 pixels a metre around (300, 271).
CENTER, SCALE = np.array([300.0, 271.0]), 50.6


def make_view(**changes) -> SceneView:
    values = {
        "corners": np.array([[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]]),
        "robot_pose": np.array([-3.0, -3.0, 0.0]),
        "robot_radius": 0.25,
        "goal": np.array([3.0, 4.0]),
        "arrival_radius": 0.5,
    }
    return SceneView(**{**values, **changes})


def shows(picture: np.ndarray, color: tuple[int, int, int], place: tuple[float, float], reach: float = 0.4) -> bool:
    """Whether a colour can be seen within reach [m] of a place in the room."""
    column, row = (CENTER + SCALE * np.array([place[0], -place[1]])).astype(int)
    pixels = round(reach * SCALE)
    part = picture[max(row - pixels, 0) : row + pixels + 1, max(column - pixels, 0) : column + pixels + 1]
    return bool((np.abs(part.astype(int) - color).max(axis=2) <= 6).any())


@pytest.fixture(scope="module")
def renderer() -> Renderer:
    return Renderer()


def test_a_picture_is_an_array_of_bytes(renderer: Renderer) -> None:
    picture = renderer.draw(make_view())
    assert (picture.shape, picture.dtype) == ((600, 600, 3), np.uint8)
    assert Renderer(size=300).draw(make_view()).shape == (300, 300, 3)


def test_things_are_drawn_where_they_are_with_y_pointing_up(renderer: Renderer) -> None:
    view = make_view(people_poses=np.array([[-3.0, 3.0, 0.0]]), people_walk=np.array([True]))
    picture = renderer.draw(view)
    for color, place in ((ROBOT, (-3, -3)), (GOAL, (3, 4)), (WALKING, (-3, 3))):
        assert shows(picture, color, place)
        assert not shows(picture, color, (place[0], -place[1]))
    assert shows(picture, WALL, (5, 0))
    assert shows(picture, FLOOR, (1, 1))


def test_a_robot_that_turns_looks_different(renderer: Renderer) -> None:
    pictures = [renderer.draw(make_view(robot_pose=np.array([0.0, 0.0, heading]))) for heading in (0.0, np.pi / 2)]
    assert not np.array_equal(*pictures)
    np.testing.assert_array_equal(pictures[0][450:], pictures[1][450:])


@pytest.mark.parametrize("kind", ObjectKind)
def test_every_kind_of_object_is_drawn(renderer: Renderer, kind: ObjectKind) -> None:
    view = make_view(
        object_poses=np.array([[2.0, -2.0, 0.3]]),
        object_sizes=np.array([[0.8, 0.6]]),
        object_kinds=np.array([kind]),
    )
    difference = (renderer.draw(view) != renderer.draw(make_view())).any(axis=2)
    rows, columns = np.nonzero(difference)
    column, row = CENTER + SCALE * np.array([2.0, 2.0])
    assert len(rows)
    assert np.abs(rows - row).max() < SCALE
    assert np.abs(columns - column).max() < SCALE


def test_interactions_and_the_trail_are_drawn(renderer: Renderer) -> None:
    view = make_view(
        interaction_lines=np.array([[0.0, 0.0, 2.0, 0.0]]),
        trail=np.array([[-4.0, 0.0], [-4.0, 1.0], [-4.0, 2.0]]),
        trail_marks=np.array([[-4.0, 0.0, 1.6]]),
    )
    picture = renderer.draw(view)
    assert shows(picture, INTERACTION, (1, 0))
    assert shows(picture, TRAIL, (-4, 1.5))
    assert not shows(renderer.draw(make_view()), TRAIL, (-4, 1.5))


def test_scores_and_outcome_stand_below_the_room(renderer: Renderer) -> None:
    bare = renderer.draw(make_view())
    for changes in (
        {"scores": Scores(0.9, 0.2)},
        {"outcome": "collision_person"},
        {"outcome": "arrived"},
        {"time": 9.0},
    ):
        picture = renderer.draw(make_view(**changes))
        np.testing.assert_array_equal(picture[:-PANEL_HEIGHT], bare[:-PANEL_HEIGHT])
        assert not np.array_equal(picture[-PANEL_HEIGHT:], bare[-PANEL_HEIGHT:])
    assert tuple(bare[-2, 300]) == PANEL


@pytest.mark.parametrize("scores", [Scores(0.0, 1.0), Scores(-0.5, 1.7)])
def test_scores_beyond_their_range_are_drawn(renderer: Renderer, scores: Scores) -> None:
    assert renderer.draw(make_view(scores=scores)).shape == (600, 600, 3)


def test_another_room_is_not_drawn_over_the_last_one(renderer: Renderer) -> None:
    fresh = renderer.draw(make_view())
    other = np.array([[-5.0, -5.0], [5.0, -5.0], [5.0, 0.0], [0.0, 0.0], [0.0, 5.0], [-5.0, 5.0]])
    assert not np.array_equal(renderer.draw(make_view(corners=other)), fresh)
    np.testing.assert_array_equal(renderer.draw(make_view()), fresh)


def test_a_picture_is_not_changed_by_the_next_one(renderer: Renderer) -> None:
    picture = renderer.draw(make_view())
    kept = picture.copy()
    renderer.draw(make_view(robot_pose=np.zeros(3)))
    np.testing.assert_array_equal(picture, kept)


def test_the_environment_draws_every_step() -> None:
    env = gym.make("SocNav2-v0", reward="sparse", render_mode="rgb_array")
    env.reset(seed=1)
    first = env.render()
    env.step(np.array([1.0, 1.0]))
    assert not np.array_equal(env.render(), first)
    env.close()


def test_a_window_opens_and_closes() -> None:
    env = gym.make("SocNav2-v0", reward="sparse", render_mode="human")
    env.reset(seed=1)
    assert pygame.display.get_surface().get_size() == (600, 600)
    start = pygame.time.get_ticks()
    for _ in range(3):
        env.step(np.zeros(2))
    assert pygame.time.get_ticks() - start >= 2 * 200 * 0.9  # keeps pace with the simulated time
    assert env.render() is None
    env.close()
    env.close()
    assert not pygame.display.get_init()


def test_without_a_mode_there_is_nothing_to_see() -> None:
    env = gym.make("SocNav2-v0", reward="sparse").unwrapped
    env.reset(seed=1)
    with pytest.warns(UserWarning, match=r"render\(\) needs gym.make"):
        assert env.render() is None


def test_before_the_first_scene_there_is_nothing_to_see() -> None:
    env = gym.make("SocNav2-v0", reward="sparse", render_mode="rgb_array").unwrapped
    with pytest.raises(gym.error.ResetNeeded, match="there is no scene yet"):
        env.render()


def test_scores_of_an_ensemble_are_drawn_like_any_others(renderer: Renderer) -> None:
    plain = renderer.draw(make_view(scores=Scores(0.9, 0.2)))
    unsure = renderer.draw(make_view(scores=Scores(0.9, 0.2, 0.1, 0.1, in_range=False)))
    np.testing.assert_array_equal(plain, unsure)
