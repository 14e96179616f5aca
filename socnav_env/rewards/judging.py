"""Scores of episodes' last seconds: of one episode, or of many in one call per scorer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from reward_model.scenes.scene import Scores
from socnav_env.rewards import Scorer

if TYPE_CHECKING:
    from reward_model.graph.frame import FrameGraph


def judge(scorer: Scorer | None, window: Sequence[FrameGraph]) -> Scores | None:
    """The scores of one window; None without a scorer."""
    return None if scorer is None else _judged(scorer, [window])[0]


def judge_all(scorers: Sequence[Scorer | None], windows: Sequence[Sequence[FrameGraph]]) -> list[Scores | None]:
    """The scores of each window, None without a scorer; windows that share a scorer are scored in one call.

    Args:
        scorers: the scorer of each window.
        windows: of one to three frames each, newest first.
    """
    places: dict[int, list[int]] = {}
    for place, scorer in enumerate(scorers):
        if scorer is not None:
            places.setdefault(id(scorer), []).append(place)
    scores: list[Scores | None] = [None] * len(windows)
    for own in places.values():
        scorer = scorers[own[0]]
        assert scorer is not None
        for place, each in zip(own, _judged(scorer, [windows[place] for place in own]), strict=True):
            scores[place] = each
    return scores


def _judged(scorer: Scorer, windows: Sequence[Sequence[FrameGraph]]) -> list[Scores]:
    """With deviations and the mark of the range, from a scorer that knows them, as `SocialScorer` does."""
    assess = getattr(scorer, "assess_windows", None)
    if assess is not None:
        scores: list[Scores] = assess(windows).rows()
        return scores
    return [Scores(q1, q2) for q1, q2 in scorer.score_windows(windows).tolist()]
