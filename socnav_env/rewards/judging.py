"""Having the last second of episodes scored: of one, or of many that take their steps one after the other."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, TypeGuard

from reward_model.fast.scoring import Scoring, ScoringTogether
from reward_model.scenes.scene import Scores
from socnav_env.rewards import EagerScorer, Scorer

if TYPE_CHECKING:
    from reward_model.graph.frame import FrameGraph


def judge(scorer: Scorer | None, window: Sequence[FrameGraph]) -> Scores | None:
    """Have one window scored; None where there is no scorer."""
    if scorer is None:
        return None
    ((q1, q2),) = scorer.score_windows([window]).tolist()
    return Scores(q1, q2)


class Judging:
    """Has windows scored, those that share a scorer together; an `EagerScorer` begins while others are still to come.

    scorers: of each window that will be added, in that order; None for those that nobody scores
    """

    def __init__(self, scorers: Sequence[Scorer | None]) -> None:
        counts = Counter(map(id, scorers))
        self._scorings = {key: _begin(each, counts[key]) for key, each in _by_id(scorers).items()}
        self._of_each = [self._scorings.get(id(each)) for each in scorers]
        self._coming = iter(self._of_each)

    def add(self, window: Sequence[FrameGraph]) -> None:
        """Take the next window."""
        scoring = next(self._coming)
        if scoring is not None:
            scoring.add(window)

    def scores(self) -> Iterator[Scores | None]:
        """Give the scores of each window, None where nobody scores it. To be called after the last one was added."""
        scores = {id(scoring): scoring.scores() for scoring in self._scorings.values()}
        for scoring in self._of_each:
            yield None if scoring is None else Scores(*next(scores[id(scoring)]))


def _by_id(scorers: Sequence[Scorer | None]) -> dict[int, Scorer]:
    return {id(each): each for each in scorers if each is not None}


def _begin(scorer: Scorer, num_windows: int) -> Scoring:
    return scorer.begin(num_windows) if _is_eager(scorer) else ScoringTogether(scorer.score_windows)


def _is_eager(scorer: Scorer) -> TypeGuard[EagerScorer]:
    return hasattr(scorer, "begin")  # to ask isinstance takes as long as an observation
