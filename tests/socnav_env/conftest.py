"""Headless drawing, and a scorer that needs no weights."""

import os

import numpy as np
import pytest

from socnav_env import rewards
from socnav_env.rewards import LearnedReward

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")


class FeatureScorer:
    """Scores that depend on all three frames of a window, cheap and in 0..1."""

    name = "features"

    def __init__(self) -> None:
        self.lengths: list[int] = []

    def score_windows(self, windows) -> np.ndarray:
        self.lengths += [len(window) for window in windows]
        sums = [[abs(float(frame.arrays.features.sum())) for frame in window] for window in windows]
        return np.array([[np.cos(row[0]) ** 2, np.cos(sum(row)) ** 2] for row in sums], dtype=np.float32)


@pytest.fixture
def feature_scorer() -> FeatureScorer:
    return FeatureScorer()


@pytest.fixture
def feature_reward(feature_scorer: FeatureScorer) -> LearnedReward:
    return LearnedReward({"social": 1.0, "arrival": 10.0, "contact": -10.0}, feature_scorer)


@pytest.fixture
def without_weights(monkeypatch: pytest.MonkeyPatch, feature_scorer: FeatureScorer) -> None:
    """Let every reward that is named be judged by the `feature_scorer`."""
    monkeypatch.setattr(rewards, "shared_scorer", lambda weights: feature_scorer)
