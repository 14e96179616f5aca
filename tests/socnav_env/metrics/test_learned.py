import numpy as np
import pytest

from socnav_env.metrics import METRICS
from tests.socnav_env.episodes import make_trajectory

SCORES = np.array([[1.0, 0.9], [0.8, 0.5], [0.39, 0.4], [0.2, 0.1]])


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("q1_mean", (1.0 + 0.8 + 0.39 + 0.2) / 4),
        ("q1_minimum", 0.2),
        ("q1_share_below_acceptable", 0.5),
        ("q2_mean", (0.9 + 0.5 + 0.4 + 0.1) / 4),
        ("q2_minimum", 0.1),
        ("q2_share_below_acceptable", 0.25),
    ],
)
def test_scores_of_an_episode(name: str, value: float) -> None:
    assert METRICS[name](make_trajectory(np.zeros((5, 2)), scores=SCORES)) == pytest.approx(value)
    assert np.isnan(METRICS[name](make_trajectory(np.zeros((5, 2)))))
