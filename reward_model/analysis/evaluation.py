"""Errors of a network's predictions against people's scores, and of people against each other."""

from __future__ import annotations

import io
import math
from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Final

import numpy as np
from scipy.stats import spearmanr

from reward_model.base.arrays import Float32Array, FloatArray
from reward_model.scenes.ratings import QUESTIONS, Ratings

_BIN: Final = 0.05  # width of a histogram's bars, on scores 0..1


@dataclass(frozen=True)
class QuestionErrors:
    """Errors of one question's predictions against its scores, both 0..1.

    Attributes:
        count: scores compared
        mse, mae: mean squared and mean absolute error
        spearman: rank correlation; NaN where all predictions or all scores are the same
    """

    count: int
    mse: float
    mae: float
    spearman: float


@dataclass(frozen=True)
class HumanCeiling:
    """People's mean squared errors on one question, of scores 0..1; NaN where no clip has more than one score.

    Attributes:
        pairs: between two scores of one clip, the mean over all pairs
        one_against_others: of a score from the mean of all others of its clip, the mean over all scores. The reference
            for a network that was trained on other people's scores
        one_against_all: the paper's: of a score from the mean of all of its clip, its own included, the mean over a
            rater's scores and then over raters. Small where a clip has few scores
        clips: number of clips that have more than one score
    """

    pairs: float
    one_against_others: float
    one_against_all: float
    clips: int


def question_errors(predictions: Float32Array, scores: Float32Array) -> dict[str, QuestionErrors]:
    """Errors of predictions by question; a question without scores is left out.

    Args:
        predictions, scores: (n, 2), scores NaN where the question was not asked.
    """
    found = {}
    for column, question in enumerate(QUESTIONS):
        known = ~np.isnan(scores[:, column])
        if known.any():
            found[question] = _errors(predictions[known, column].astype(float), scores[known, column].astype(float))
    return found


def human_ceiling(ratings: Ratings, question: int) -> HumanCeiling:
    """People's errors on one question, 0 for Q1 or 1 for Q2, from the clips that have more than one score."""
    clips = [rows for rows in ratings.of_question(question).values() if len(rows) > 1]
    pairs: list[float] = []
    others: list[float] = []
    of_rater: dict[str, list[float]] = {}
    for rows in clips:
        scores = [score for _, score in rows]
        total, count = sum(scores), len(scores)
        pairs += [(one - other) ** 2 for one, other in combinations(scores, 2)]
        for rater, score in rows:
            others.append((score - (total - score) / (count - 1)) ** 2)
            of_rater.setdefault(rater, []).append((score - total / count) ** 2)
    every_rater = [_mean(errors) for _, errors in sorted(of_rater.items())]
    return HumanCeiling(_mean(pairs), _mean(others), _mean(every_rater), len(clips))


def error_histogram(predictions: Float32Array, scores: Float32Array, question: str) -> bytes:
    """A PNG with a histogram of absolute errors. predictions, scores: (n, 2) as for `question_errors`."""
    from matplotlib.figure import Figure

    column = QUESTIONS.index(question)
    known = ~np.isnan(scores[:, column])
    errors = np.abs(predictions[known, column] - scores[known, column])
    edges = np.arange(math.ceil(max(1.0, float(errors.max(initial=0))) / _BIN) + 1) * _BIN
    figure = Figure(figsize=(6, 3.5), layout="constrained")
    axes = figure.subplots()
    axes.hist(errors, bins=edges.tolist(), color="tab:blue", edgecolor="white", linewidth=0.5)
    axes.axvline(float(errors.mean()), color="tab:orange", label=f"mean {errors.mean():.3f}")
    axes.set(xlabel=f"absolute error of {question.upper()}", ylabel="scores", xlim=(0, edges[-1]))
    axes.legend(frameon=False)
    image = io.BytesIO()
    figure.savefig(image, format="png", dpi=120)
    return image.getvalue()


def report(predictions: Float32Array, scores: Float32Array, ratings: Ratings) -> dict[str, dict[str, float | None]]:
    """The report for JSON: errors of each question that has scores, and the human ceiling where there is one.

    NaN becomes None.
    """
    found = {}
    for question, errors in question_errors(predictions, scores).items():
        ceiling = human_ceiling(ratings, QUESTIONS.index(question))
        human = {f"human_{name}": value for name, value in asdict(ceiling).items()} if ceiling.clips else {}
        numbers = asdict(errors) | human
        found[question] = {name: None if math.isnan(value) else value for name, value in numbers.items()}
    return found


def rank_correlation(one: Float32Array | FloatArray, other: Float32Array | FloatArray) -> float | None:
    """Spearman's, None where one of the two is the same throughout."""
    if len(one) < 2 or np.ptp(one) == 0 or np.ptp(other) == 0:
        return None
    return float(spearmanr(one, other).statistic)


def _errors(predictions: FloatArray, scores: FloatArray) -> QuestionErrors:
    differences = predictions - scores
    correlation = rank_correlation(predictions, scores)
    return QuestionErrors(
        len(scores),
        float((differences**2).mean()),
        float(np.abs(differences).mean()),
        math.nan if correlation is None else correlation,
    )


def _mean(values: list[float]) -> float:
    return float(np.mean(values)) if values else math.nan
