import json

import numpy as np
import pytest

from benchmarks.time_scale import Episodes, auc, main, separations
from benchmarks.walk_scenes import walk_scene, windows_of


def test_the_auc_is_the_share_of_pairs_in_order() -> None:
    scores, impolite = np.array([0.1, 0.5, 0.5, 0.9]), np.array([True, True, False, False])
    assert auc(scores, impolite) == pytest.approx(3.5 / 4)  # one of four pairs is tied
    assert auc(-scores, impolite) == pytest.approx(0.5 / 4)
    assert np.isnan(auc(scores, np.zeros(4, dtype=np.bool_)))


def test_a_row_compares_both_times() -> None:
    touched, close = np.array([True, False, False, False]), np.array([True, True, False, False])
    lowest = np.array([[0.9, 0.1], [0.1, 0.2], [0.2, 0.8], [0.3, 0.9]])
    rows = separations("here", Episodes(touched, close, lowest, lowest))
    assert [(row.impolite, row.score) for row in rows] == [
        ("touched", "lowest"),
        ("touched", "mean"),
        ("0.45 m", "lowest"),
        ("0.45 m", "mean"),
    ]
    assert (rows[0].num_impolite, rows[0].num_episodes, rows[0].real, rows[0].slowed) == (1, 4, 0.0, 1.0)
    assert (rows[0].low, rows[0].high) == (1.0, 1.0)
    assert (rows[2].real, rows[2].slowed) == (0.5, 1.0)
    assert (rows[2].polite_real, rows[2].polite_slowed) == pytest.approx((0.25, 0.85))


def test_a_walk_is_a_scene_of_a_robot() -> None:
    time = 0.05 * np.arange(97)[:, None]
    path = np.hstack([1.5 * time, np.zeros((97, 1))])  # along x at 1.5 m/s, from 0 to 7.2 m
    beside = np.hstack([1.0 * time, np.full((97, 1), 2.0)])
    gone = np.full((97, 2), np.nan)
    far = np.tile([3.6, 6.0], (97, 1))
    scene = walk_scene(path, np.stack([beside, gone, far]), np.array([8.0, 0.0]))
    assert (len(scene), scene.last.timestamp) == (24, pytest.approx(4.8))
    np.testing.assert_allclose(scene.last.command, [1.5, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(scene.last.goal, [0.8, 0.0], atol=1e-12)
    assert scene.last.people.ids.tolist() == [1]
    np.testing.assert_allclose(scene.last.people.poses, [[-2.4, 2.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(scene.last.people.velocities, [[-0.5, 0.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(scene.last.walls[0], [1.4, 5.0, 1.4, -5.0], atol=1e-12)
    windows = windows_of(scene)
    assert (len(windows), {len(window) for window in windows}) == (14, {3})


def test_a_quick_run_has_three_settings(tmp_path, capsys) -> None:
    assert main(["--quick", "--output", str(tmp_path / "rows.json")]) == 0
    assert "default weights, slowed 2.69 times" in capsys.readouterr().out
    rows = json.loads((tmp_path / "rows.json").read_text())
    assert [row["setting"] for row in rows[::4]] == ["defaults", "pedestrians", "sped up"]
    assert {row["num_episodes"] for row in rows} == {6}
