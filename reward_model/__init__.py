"""What people think of a robot's last second, learned from their scores. See `load_scorer`.

Everything is imported when it is first asked for: reading scenes does not load PyTorch.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from reward_model.scenario import LabelledSequence, ScenarioError, Scores, Sequence, Snapshot
    from reward_model.scorer import SocialScorer, load_scorer
    from reward_model.socnav1 import read_socnav1
    from reward_model.socnav2_json import read_socnav2, write_socnav2

_HOMES: Final = {
    "LabelledSequence": "scenario",
    "ScenarioError": "scenario",
    "Scores": "scenario",
    "Sequence": "scenario",
    "Snapshot": "scenario",
    "SocialScorer": "scorer",
    "load_scorer": "scorer",
    "read_socnav1": "socnav1",
    "read_socnav2": "socnav2_json",
    "write_socnav2": "socnav2_json",
}

__all__ = [
    "LabelledSequence",
    "ScenarioError",
    "Scores",
    "Sequence",
    "Snapshot",
    "SocialScorer",
    "load_scorer",
    "read_socnav1",
    "read_socnav2",
    "write_socnav2",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
