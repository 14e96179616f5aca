"""A model of how acceptable people find a robot's last second, learned from their scores. See `load_scorer`.

Names are imported on first use: reading scenes does not load PyTorch.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from reward_model.base.lazy import lazy_attributes

if TYPE_CHECKING:
    from reward_model.scenes.scene import LabelledSequence, ScenarioError, SceneSequence, Scores, Sequence, Snapshot
    from reward_model.scenes.socnav1 import read_socnav1
    from reward_model.scenes.socnav2_json import read_socnav2, write_socnav2
    from reward_model.scorer import SocialScorer, load_scorer

_HOMES: Final = {
    "LabelledSequence": "scenes.scene",
    "ScenarioError": "scenes.scene",
    "Scores": "scenes.scene",
    "SceneSequence": "scenes.scene",
    "Sequence": "scenes.scene",
    "Snapshot": "scenes.scene",
    "SocialScorer": "scorer",
    "load_scorer": "scorer",
    "read_socnav1": "scenes.socnav1",
    "read_socnav2": "scenes.socnav2_json",
    "write_socnav2": "scenes.socnav2_json",
}

__all__ = [
    "LabelledSequence",
    "ScenarioError",
    "SceneSequence",
    "Scores",
    "Sequence",
    "Snapshot",
    "SocialScorer",
    "load_scorer",
    "read_socnav1",
    "read_socnav2",
    "write_socnav2",
]

__getattr__ = lazy_attributes(__name__, _HOMES)
