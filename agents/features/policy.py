"""PPO's network on the `entities` observation, and the buffer of what it has seen.

What `EntityFeatures` reads of an observation is worked out once: for the actor and the critic together, and in
training for all passes over the same samples.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.buffers import DictRolloutBuffer
from stable_baselines3.common.policies import MultiInputActorCriticPolicy
from stable_baselines3.common.type_aliases import DictRolloutBufferSamples
from torch import Tensor

from agents.features.extractor import capacities_of, describe, described


class EntityPolicy(MultiInputActorCriticPolicy):
    """SB3's `MultiInputPolicy` whose actor and critic have an `EntityFeatures` each."""

    def extract_features(self, obs: Any, features_extractor: Any = None) -> Any:
        """Return the actor's features and the critic's, of observations or of what was made of them before."""
        assert isinstance(self.observation_space, spaces.Dict)
        given = described(obs, capacities_of(self.observation_space))
        return self.pi_features_extractor(given), self.vf_features_extractor(given)


class EntityRolloutBuffer(DictRolloutBuffer):
    """SB3's buffer, whose samples have what `describe` makes of the observations in their place."""

    def reset(self) -> None:
        """Forget everything."""
        self._described: dict[str, Tensor] = {}
        super().reset()

    def _get_samples(self, batch_inds: NDArray[np.int64], env: Any = None) -> DictRolloutBufferSamples:  # type: ignore[override]  # as SB3's
        if not self._described:
            observations = {key: self.to_torch(values) for key, values in self.observations.items()}
            self._described = describe(observations, capacities_of(self.observation_space))
        chosen = torch.from_numpy(batch_inds)
        return DictRolloutBufferSamples(
            observations={key: values[chosen] for key, values in self._described.items()},
            actions=self.to_torch(self.actions[batch_inds]),
            old_values=self.to_torch(self.values[batch_inds].flatten()),
            old_log_prob=self.to_torch(self.log_probs[batch_inds].flatten()),
            advantages=self.to_torch(self.advantages[batch_inds].flatten()),
            returns=self.to_torch(self.returns[batch_inds].flatten()),
        )
