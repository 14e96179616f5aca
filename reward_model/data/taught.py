"""Windows with a teacher's scores of their four images, and what of these another network should learn."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from reward_model.base.arrays import Float32Array
from reward_model.data.labelled_windows import LabelledWindows
from reward_model.graph.facts import TrainingRange, facts_of
from reward_model.graph.star import Stars
from reward_model.networks.star import CONTACT_DISTANCES, CONTACT_SCORE, in_contact

TEACHER_RANGE: Final = TrainingRange(
    {
        "extent": (6.0, 15.0),
        "people": (0, 26),
        "objects": (0, 100),
        "goal": (0.0, 11.0),
        "speed": (0.0, 0.9),
        "turn": (0.0, 0.45),
    }
)
"""The facts between which the published network agrees with itself.

Its scores of a scene's four images differ from their mean by a mean square of .003 in ordinary rooms; beyond these
limits by more than .006 (in rooms of 3 to 4 m .025, of 19 to 20 m .025, for a goal at 12 to 14 m .008), measured over
225,000 training windows one fact at a time.
"""

_MASKED_DEPTH: Final = 0.1  # m, of overlaps: no smooth function follows the step at contact


class TaughtWindows(NamedTuple):
    """Windows and a teacher's scores.

    Attributes:
        stars: the windows
        images: (num_windows, 4, 2) the scores of their images, see `image_scores`
    """

    stars: Stars
    images: Float32Array

    @property
    def symmetrised(self) -> Float32Array:
        """The symmetrised teacher's scores (num_windows, 2) in 0..1: the mean over the images."""
        mean: Float32Array = self.images.mean(axis=1).clip(0.0, 1.0)
        return mean

    @property
    def touching(self) -> NDArray[np.bool_]:
        """Whether the robot is in contact, (num_windows,)."""
        return in_contact(self.stars.surroundings)

    @property
    def in_teacher_range(self) -> NDArray[np.bool_]:
        """Whether a window is within `TEACHER_RANGE` and out of contact, (num_windows,)."""
        return TEACHER_RANGE.contains(facts_of(self.stars)) & ~self.touching

    def to_learn(self) -> LabelledWindows:
        """The windows with the scores that a network should learn.

        They are the symmetrised teacher's, in contact at most 0.05 and, in overlaps of less than 0.1 m, unknown.
        """
        depths = np.array(CONTACT_DISTANCES, dtype=np.float32) - self.stars.surroundings[:, :3]
        scores = self.symmetrised.copy()
        scores[self.touching] = np.minimum(scores[self.touching], CONTACT_SCORE)
        scores[self.touching & (depths.max(axis=1) < _MASKED_DEPTH)] = np.nan
        return LabelledWindows(self.stars, scores)
