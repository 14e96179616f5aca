from dataclasses import replace

import numpy as np
import pytest

from reward_model.analysis.heatmap import ACTIONS, heatmap, is_inside, placed, score_positions
from reward_model.analysis.synthetic_scenes import Person, SyntheticScene, Thing
from reward_model.data.augmentation import mirrored
from reward_model.graph.frame import FrameGraph
from reward_model.graph.windows import sequence_frames
from reward_model.scenes.scene import ScenarioError, SceneSequence
from reward_model.scenes.socnav2_json import read_socnav2
from reward_model.scorer import load_scorer

L_SHAPE = np.array([[0, 0, 0, 4], [0, 4, 4, 4], [4, 4, 4, 2], [4, 2, 2, 2], [2, 2, 2, 0], [2, 0, 0, 0]], dtype=float)

CROWD = SyntheticScene(
    goal=(3.0, 1.0),
    command=(0.2, 0.3),
    people=[Person(2.0, 1.0, 0.5, 0.6), Person(-1.0, 2.0, -1.0)],
    objects=[Thing(1.0, -1.0, 0.3, 0.8, 0.6)],
    interactions=[(2, 3)],
)


class FeatureScorer:
    """Scores a window by the sums of its frames' features, absolute ones first: blind to mirrors, then not."""

    def score_windows(self, windows: list[list[FrameGraph]]) -> np.ndarray:
        sums = [
            [
                sum(np.abs(frame.arrays.features).sum() for frame in window),
                sum(frame.arrays.features.sum() for frame in window),
            ]
            for window in windows
        ]
        return np.array(sums, dtype=np.float32)


def assert_same(first: SceneSequence, second: SceneSequence) -> None:
    for one, other in zip(first, second, strict=True):
        np.testing.assert_allclose(one.command, other.command, atol=1e-9)
        np.testing.assert_allclose(one.goal, other.goal, atol=1e-9)
        np.testing.assert_allclose(one.walls, other.walls, atol=1e-9)
        for mine, theirs in ((one.people, other.people), (one.objects, other.objects)):
            np.testing.assert_allclose(mine.poses, theirs.poses, atol=1e-9)
            np.testing.assert_allclose(mine.velocities, theirs.velocities, atol=1e-9)


def window(sequence: SceneSequence) -> SceneSequence:
    """Only the snapshots that are looked at."""
    return SceneSequence(tuple(sequence.snapshots[index] for index in (0, 5, 10)))


def test_the_centre_scores_as_the_scene_itself():
    sequence = CROWD.sequence()
    scored = heatmap(FeatureScorer(), sequence, resolution=3)
    plain = FeatureScorer().score_windows([sequence_frames(sequence)])[0]
    assert scored.x[1] == pytest.approx(0, abs=1e-12)
    assert scored.y[1] == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(scored.scores[1, 1], plain, rtol=1e-6)
    assert (scored.scores[0, 0] != plain).all()


def test_the_grid_is_of_cell_centres_over_the_walls():
    scored = heatmap(FeatureScorer(), SyntheticScene((1.0, 1.0), side=6.0).sequence(), resolution=3)
    np.testing.assert_allclose(scored.x, [-2, 0, 2], atol=1e-12)
    np.testing.assert_allclose(scored.y, [-2, 0, 2], atol=1e-12)
    assert scored.scores.shape == (3, 3, 2)
    assert scored.inside.all()


def test_positions_outside_the_room_have_scores_and_are_marked():
    sequence = SyntheticScene((1.0, 1.0), side=6.0, robot=(0.0, 0.0, np.pi / 4)).sequence()
    scored = heatmap(FeatureScorer(), sequence, resolution=5)
    assert np.isfinite(scored.scores).all()
    assert scored.inside.astype(int).tolist() == [
        [0, 0, 1, 0, 0],
        [0, 1, 1, 1, 0],
        [1, 1, 1, 1, 1],
        [0, 1, 1, 1, 0],
        [0, 0, 1, 0, 0],
    ]


def test_a_mirrored_scene_has_the_mirrored_map():
    sequence = CROWD.sequence()
    for action, opposite in ((None, None), (ACTIONS["forward-left"], ACTIONS["forward-right"])):
        scored = heatmap(FeatureScorer(), sequence, action, 5)
        other = heatmap(FeatureScorer(), mirrored(sequence), opposite, 5)
        np.testing.assert_allclose(other.scores[:, ::-1, 0], scored.scores[..., 0], rtol=1e-5)
        assert (np.abs(other.scores[:, ::-1, 1] - scored.scores[..., 1]) > 1e-3).all()


def test_a_moved_robot_sees_the_scene_as_if_recorded_there():
    """On an arc older frames have other headings, and velocities change with the place."""
    seen = placed(CROWD.sequence(), np.array([0.7, -0.4]))
    assert_same(seen, window(replace(CROWD, robot=(0.7, -0.4, 0.0)).sequence()))


@pytest.mark.parametrize("name", ACTIONS)
def test_an_action_looks_as_if_it_had_been_driven(name):
    seen = placed(CROWD.sequence(), np.array([0.7, -0.4]), ACTIONS[name])
    assert_same(seen, window(replace(CROWD, robot=(0.7, -0.4, 0.0), command=ACTIONS[name]).sequence()))


def test_stopping_leaves_people_their_own_velocities():
    last = placed(CROWD.sequence(), np.zeros(2), ACTIONS["stop"]).last
    np.testing.assert_allclose(last.command, [0, 0, 0])
    np.testing.assert_allclose(last.people.velocities[0], [0.6 * np.cos(0.5), 0.6 * np.sin(0.5), 0], atol=1e-9)
    np.testing.assert_allclose(last.people.velocities[1], 0, atol=1e-9)
    np.testing.assert_allclose(last.objects.velocities, 0, atol=1e-9)


def test_a_lone_snapshot_is_taken_to_move_as_commanded():
    driving = SyntheticScene((3.0, 0.0), command=(0.3, 0.0), people=[Person(2.0, 1.0)])
    alone = SceneSequence((driving.sequence().last,))
    np.testing.assert_allclose(alone.last.people.velocities, [[-0.3, 0, 0]], atol=1e-12)
    stopped = placed(alone, np.zeros(2), ACTIONS["stop"]).last
    np.testing.assert_allclose(stopped.people.velocities, [[0, 0, 0]], atol=1e-12)


def test_a_first_snapshot_without_velocities_stands_still():
    scene = SyntheticScene((3.0, 0.0), people=[Person(2.0, 1.0)]).sequence().last
    alone = SceneSequence((replace(scene, command=np.array([0.3, 0.0, 0.0])),))
    stopped = placed(alone, np.zeros(2), ACTIONS["stop"]).last
    np.testing.assert_allclose(stopped.people.velocities, [[0, 0, 0]], atol=1e-12)


def test_nothing_to_score():
    assert score_positions(FeatureScorer(), CROWD.sequence(), np.zeros((0, 2))).shape == (0, 2)


def test_every_position_is_reported_once():
    counts: list[int] = []
    heatmap(FeatureScorer(), SyntheticScene((1.0, 1.0)).sequence(), resolution=18, report=counts.append)
    assert counts == [256, 68]


def test_inside_an_l_shaped_room():
    points = np.array([[1, 1], [3, 3], [3, 1], [1, 5], [-1, 2]], dtype=float)
    assert is_inside(L_SHAPE, points).tolist() == [True, True, False, False, False]
    assert is_inside(L_SHAPE[::-1], points).tolist() == [True, True, False, False, False]


@pytest.mark.parametrize(
    ("walls", "complaint"),
    [
        (L_SHAPE[:2], "a heatmap needs walls around a room, at least 3, got 2"),
        (L_SHAPE[:5], "0 others end within 0.1 m of the wall's end at x=0.00, y=0.00; it must be one"),
    ],
)
def test_walls_that_enclose_nothing_are_refused(walls, complaint):
    sequence = SyntheticScene((1.0, 1.0)).sequence("den")
    open_room = SceneSequence(tuple(replace(snapshot, walls=walls) for snapshot in sequence), "den")
    with pytest.raises(ScenarioError, match=complaint) as caught:
        heatmap(FeatureScorer(), open_room)
    assert str(caught.value).startswith("den: ")


def test_walls_that_change_are_refused():
    first, *others = SyntheticScene((1.0, 1.0)).sequence("den")
    sequence = SceneSequence((replace(first, walls=first.walls[:3]), *others), "den")
    with pytest.raises(ScenarioError, match=r"den: a scene's walls must not change: 4 walls at 2.0 s, 3 at 0.0 s"):
        heatmap(FeatureScorer(), sequence)


def test_no_resolution_is_refused():
    with pytest.raises(ValueError, match="resolution must be at least 1, got 0"):
        heatmap(FeatureScorer(), CROWD.sequence(), resolution=0)


def test_scores_that_are_no_numbers_are_refused():
    class Undecided:
        def score_windows(self, windows):
            return np.full((len(windows), 2), np.nan, dtype=np.float32)

    with pytest.raises(ScenarioError, match="every score must be finite"):
        heatmap(Undecided(), CROWD.sequence(), resolution=2)


def test_genuine_scenes_score_as_published_where_they_were_recorded(shared_data, published_weights):
    scorer = load_scorer("published")
    for name in ("S1_000000", "S2F_000000", "S3I_000000"):
        sequence = read_socnav2(shared_data / "socnav2_samples" / f"{name}.json")
        at_home = score_positions(scorer, sequence, np.zeros((1, 2)))[0]
        np.testing.assert_allclose(at_home, scorer.score(sequence)[:2], atol=1e-6)
