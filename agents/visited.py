"""Windows of the states that a trained agent visits, to train a reward model where it will be optimised."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, Final

import numpy as np

from agents.envs import SocNavMaker
from agents.policy import Policy, act
from agents.policy_files import load_agent
from reward_model.graph.frame import FrameGraph

MOST_WINDOWS: Final = 8  # of an episode
_SPACING: Final = 10  # control steps between two of them, on average


@dataclass(frozen=True)
class AgentEpisode:
    """Plays an episode in which the agent is deterministic or explores, seen by people or not.

    Half of the episodes are of each kind. The windows are those of random steps and of the last one.

    Attributes:
        agent: name or path, as for `load_agent`
    """

    agent: str

    @property
    def name(self) -> str:
        """What a set of such windows is called."""
        return f"agent {self.agent}"

    def __call__(self, rng: np.random.Generator) -> list[list[FrameGraph]]:
        """The windows of one episode, whose seed is drawn."""
        deterministic, visible = rng.random(2) < 0.5
        policy = _policy(self.agent)
        config = {} if visible else {"people": {"robot_visibility": 0.0}}
        env: Any = SocNavMaker(config=config)()  # whose reward has a scorer, so that there are windows
        observation, _ = env.reset(seed=int(rng.integers(2**31)))
        windows, ended = [], False
        while not ended:
            action = act(policy, env, observation, bool(deterministic))
            observation, _, terminated, truncated, _ = env.step(action)
            ended = terminated or truncated
            if ended or rng.random() < 1 / _SPACING:
                windows.append(env.unwrapped.window())
        env.close()
        chosen = rng.choice(len(windows), min(MOST_WINDOWS, len(windows)), replace=False)
        return [windows[index] for index in sorted(chosen.tolist())]


@cache
def _policy(agent: str) -> Policy:
    return load_agent(agent)
