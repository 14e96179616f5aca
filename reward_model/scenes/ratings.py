"""Ratings: a table of clips, raters and scores, from which agreement among people is computed."""

from __future__ import annotations

import csv
import io
import math
import os
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from reward_model.base.arrays import FloatArray
from reward_model.scenes.json_fields import read_text_file
from reward_model.scenes.scene import LabelledSequence, ScenarioError
from reward_model.scenes.socnav1 import read_socnav1

QUESTIONS: Final = ("q1", "q2")
_HIGHEST: Final = 100.0  # a perfect score in the files


@dataclass(frozen=True, eq=False)
class Ratings:
    """People's scores of clips, one rating a row; a rater who scored a clip twice has two rows, the first time first.

    Attributes:
        clips: name of the clip, the same for all its ratings. A scene, the unit of splits, may have several clips:
            SocNav1's scene 02130 has two, `02130 A` and `02130 B`, that differ as much as any two others
        raters: name of the rater
        scores: (num_ratings, 2) Q1 and Q2 in 0..1, NaN where the question was not asked
    """

    clips: tuple[str, ...]
    raters: tuple[str, ...]
    scores: FloatArray

    def __len__(self) -> int:
        return len(self.clips)

    def of_question(self, question: int) -> dict[str, list[tuple[str, float]]]:
        """The raters and scores of one question, 0 for Q1 or 1 for Q2, by clip, in the order of the rows."""
        found: dict[str, list[tuple[str, float]]] = defaultdict(list)
        for clip, rater, score in zip(self.clips, self.raters, self.scores[:, question].tolist(), strict=True):
            if not math.isnan(score):
                found[clip].append((rater, score))
        return dict(found)


def ratings_of(labelled: Iterable[LabelledSequence]) -> Ratings:
    """The ratings of labelled sequences; a sequence's name is that of its clip."""
    rows = [(each.sequence.name, each.rater, _score(each.q1), _score(each.q2)) for each in labelled]
    return Ratings(
        tuple(row[0] for row in rows),
        tuple(row[1] for row in rows),
        np.array([row[2:] for row in rows], dtype=np.float64).reshape(-1, 2),
    )


def read_ratings(paths: Iterable[str | os.PathLike[str]]) -> Ratings:
    """Read ratings from SocNav1 files (`.jsonl`) and tables (`.csv`) into one table.

    A `.csv` table has the columns `clip`, `rater` and `q1`, `q2` or both, scores 0..100 or empty.

    Raises:
        ScenarioError: Naming the file, the line, the field and the rule.
    """
    parts = []
    for path in map(Path, paths):
        if path.suffix == ".csv":
            parts.append(_read_table(path))
        elif path.suffix == ".jsonl":
            parts.append(ratings_of(read_socnav1(path)))
        else:
            raise ScenarioError(f"{path}: ratings must be a .csv table or a SocNav1 .jsonl file")
    return Ratings(
        tuple(clip for part in parts for clip in part.clips),
        tuple(rater for part in parts for rater in part.raters),
        np.concatenate([np.zeros((0, 2)), *(part.scores for part in parts)]),
    )


def _score(score: float | None) -> float:
    return math.nan if score is None else score


def _read_table(path: Path) -> Ratings:
    reader = csv.DictReader(io.StringIO(read_text_file(path)), skipinitialspace=True)
    header = set(reader.fieldnames or ())
    if not {"clip", "rater"} <= header or not header & set(QUESTIONS):
        raise ScenarioError(f"{path}: the first line must name the columns clip, rater and q1, q2 or both")
    clips, raters, scores = [], [], []
    for row in _rows(reader, path):
        place = f"{path}: line {reader.line_num}"
        if not row["clip"] or not row["rater"]:
            raise ScenarioError(f"{place}: clip and rater must not be empty")
        clips.append(row["clip"])
        raters.append(row["rater"])
        scores.append([_parse_score(row.get(question), f"{place}: {question}") for question in QUESTIONS])
    if not clips:
        raise ScenarioError(f"{path}: must hold at least one rating, got none")
    return Ratings(tuple(clips), tuple(raters), np.array(scores))


def _rows(reader: csv.DictReader[str], path: Path) -> Iterator[dict[str, str]]:
    try:
        yield from reader
    except csv.Error as error:
        raise ScenarioError(f"{path}: must be a CSV table ({error})") from None


def _parse_score(text: str | None, place: str) -> float:
    if not text:
        return math.nan
    try:
        score = float(text)
    except ValueError:
        score = math.nan
    if not 0 <= score <= _HIGHEST:
        raise ScenarioError(f"{place} must be a number in 0..{_HIGHEST:g} or empty, got {text!r}")
    return score / _HIGHEST
