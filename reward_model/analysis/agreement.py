"""Agreement of raters with each other and with themselves: linearly weighted kappa (Cohen 1968)."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from reward_model.base.arrays import FloatArray, IntArray
from reward_model.scenes.ratings import Ratings


@dataclass(frozen=True, eq=False)
class Agreement:
    """Agreement on one question.

    Attributes:
        raters: in alphabetical order
        kappa: (num_raters, num_raters) linearly weighted; on the diagonal a rater's first scores against their second
            ones. NaN where two raters have no clip in common, or all scores compared are one value
        counts: (num_raters, num_raters) number of pairs of scores compared
    """

    raters: tuple[str, ...]
    kappa: FloatArray
    counts: IntArray


def agreement(ratings: Ratings, question: int) -> Agreement:
    """Compare all raters on one question, 0 for Q1 or 1 for Q2.

    Where two raters scored a clip more than once, every score of the one is compared with every score of the other.
    """
    pairs = _score_pairs(ratings.of_question(question))
    raters = tuple(sorted(set(ratings.raters)))
    kappa = np.full((len(raters), len(raters)), math.nan)
    counts = np.zeros(kappa.shape, dtype=np.int64)
    for row, one in enumerate(raters):
        for column, other in enumerate(raters[row:], start=row):
            scores = np.array(pairs.get((one, other), [])).reshape(-1, 2)
            kappa[row, column] = kappa[column, row] = weighted_kappa(scores[:, 0], scores[:, 1])
            counts[row, column] = counts[column, row] = len(scores)
    return Agreement(raters, kappa, counts)


def weighted_kappa(first: FloatArray, second: FloatArray) -> float:
    """Linearly weighted kappa of two lists of scores of the same things: 1 for equal ones, 0 for chance.

    1 minus the mean distance of the pairs divided by the mean distance of any score of the one list from any of
    the other. On whole numbers this is Cohen's weighted kappa with weights |i - j|; scores need no categories.

    Args:
        first, second: (n,)

    Returns:
        NaN where all scores are the same or there are none.
    """
    if not len(first):
        return math.nan
    by_chance = _mean_distance(first, second)
    return 1 - float(np.abs(first - second).mean()) / by_chance if by_chance > 0 else math.nan


def _score_pairs(clips: dict[str, list[tuple[str, float]]]) -> dict[tuple[str, str], list[tuple[float, float]]]:
    """Pairs of scores of the same clip, by pair of raters or by a rater paired with themselves."""
    pairs: dict[tuple[str, str], list[tuple[float, float]]] = defaultdict(list)
    for rows in clips.values():
        scores: dict[str, list[float]] = defaultdict(list)
        for rater, score in rows:
            scores[rater].append(score)
        for one in scores:
            pairs[one, one] += zip(scores[one], scores[one][1:], strict=False)
            for other in scores:
                if one < other:
                    pairs[one, other] += [(a, b) for a in scores[one] for b in scores[other]]
    return pairs


def _mean_distance(first: FloatArray, second: FloatArray) -> float:
    """The mean of |a - b| over all a in `first` and b in `second`, in memory linear in their lengths."""
    ordered = np.sort(second)
    sums = np.concatenate([[0.0], np.cumsum(ordered)])
    below = np.searchsorted(ordered, first)
    above = len(ordered) - below
    distances = first * below - sums[below] + (sums[-1] - sums[below]) - first * above
    return max(0.0, float(distances.mean()) / len(ordered))
