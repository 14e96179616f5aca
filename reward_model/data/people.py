"""People's ratings that join the training on a teacher's scores."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.progress import Progress

from reward_model.analysis.evaluation import human_ceiling, question_errors
from reward_model.data.examples import Examples
from reward_model.data.labelled_windows import LabelledWindows, joined
from reward_model.data.loading import DataConfig, load_parts
from reward_model.graph.star import Stars
from reward_model.scorer import SocialScorer


class PeopleRatings(NamedTuple):
    """Ratings for training, and ratings of other scenes on which errors are reported."""

    train: Examples
    development: Examples

    def joined(self, taught: LabelledWindows, share: float, seed: int) -> LabelledWindows:
        """Windows with a teacher's scores, and so many ratings that they are a share of all.

        Every rating occurs as often as any other, or once more.

        Args:
            share: 0 up to 1, excluded
        """
        order = np.random.default_rng(seed).permutation(len(self.train))
        chosen = np.resize(order, round(len(taught) * share / (1 - share)))
        people = Stars.of_windows(list(self.train.windows)).taken(chosen)
        return joined([taught, LabelledWindows(people, self.train.scores[chosen])])

    def report(self, scorer: SocialScorer) -> dict[str, Any]:
        """The numbers of ratings, the scorer's errors of Q1 on the development part, and people's among themselves."""
        found = question_errors(scorer.score_windows(list(self.development.windows)), self.development.scores)["q1"]
        return {
            "ratings": len(self.train),
            "development_ratings": found.count,
            "development_mse": found.mse,
            "development_spearman": found.spearman,
            "human_mse": human_ceiling(self.development.ratings(), 0).one_against_others,
        }


def read_people(folder: Path, progress: Progress) -> PeopleRatings:
    """Read a data set that is split, such as SocNav1's folder. Raises as `load_parts`."""
    parts = load_parts(DataConfig(folder, augmentation="none"), progress)
    return PeopleRatings(parts["train"], parts["development"])
