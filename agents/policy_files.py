"""Agents by name or path, and trained networks as files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from agents.baselines import BASELINES
from agents.policy import Policy
from agents.storage import AgentError, read_tensors, require, write_tensors

if TYPE_CHECKING:
    from gymnasium import spaces
    from stable_baselines3.common.policies import ActorCriticPolicy
    from torch import Tensor

AGENT_FILE = "agent.safetensors"
SHIPPED_FOLDER = Path(__file__).parent / "weights"
AGENT_LAYOUT = "socnav2-agent-2"


def load_agent(name_or_path: str | Path) -> Policy:
    """Return an agent by name or path.

    Args:
        name_or_path: `random`, `straight`, the name of an agent that ships with the package, the output folder
            of a training run, or an agent's file.

    Raises:
        AgentError: there is no such agent, or its file is broken; the message lists the names.
    """
    name = str(name_or_path)
    if name in BASELINES:
        return BASELINES[name]()
    for path in (SHIPPED_FOLDER / f"{name}.safetensors", Path(name) / AGENT_FILE, Path(name)):
        if path.is_file():
            return load_policy(path)
    raise AgentError(f"no agent {name!r}; valid are {', '.join(agent_names())}, a run's folder or an agent's file")


def agent_names() -> list[str]:
    """Return the names that `load_agent` knows: the baselines and the agents that ship with the package."""
    return [*BASELINES, *sorted(path.stem for path in SHIPPED_FOLDER.glob("*.safetensors"))]


def build_policy(
    observation_space: spaces.Dict, action_space: spaces.Box, architecture: dict[str, Any]
) -> ActorCriticPolicy:
    """Return an untrained network whose sizes are given as `policy_arguments` gives them."""
    from agents.features.policy import EntityPolicy

    return EntityPolicy(observation_space, action_space, lambda _: 0.0, **policy_arguments(architecture))


def policy_arguments(architecture: dict[str, Any]) -> dict[str, Any]:
    """Return SB3's `policy_kwargs` for `entity_width`, `net_arch` and `log_std_init`."""
    from torch import nn

    from agents.features.extractor import EntityFeatures

    layers = list(architecture["net_arch"])
    return {
        "features_extractor_class": EntityFeatures,
        "features_extractor_kwargs": {"hidden": architecture["entity_width"]},
        "share_features_extractor": False,  # the value's gradients are far larger and would drown the policy's
        "net_arch": {"pi": layers, "vf": layers},
        "activation_fn": nn.ReLU,
        "log_std_init": architecture["log_std_init"],
        "optimizer_kwargs": {"eps": 1e-5, "fused": True},  # SB3's epsilon; one call instead of many small ones
    }


def save_policy(policy: ActorCriticPolicy, architecture: dict[str, Any], path: Path) -> None:
    """Write a trained network to one safetensors file, its sizes and spaces in the file's header."""
    description = {
        "architecture": architecture,
        "observation": {
            key: {"low": box.low.tolist(), "high": box.high.tolist()}
            for key, box in policy.observation_space.spaces.items()  # type: ignore[attr-defined]
        },
        "action": {"low": policy.action_space.low.tolist(), "high": policy.action_space.high.tolist()},  # type: ignore[attr-defined]
    }
    write_tensors(path, AGENT_LAYOUT, network_tensors(policy), description)


def network_tensors(policy: ActorCriticPolicy) -> dict[str, Tensor]:
    """Return the weights of a network by name, each once, though SB3 knows a shared part by three names."""
    return {name: tensor.detach().contiguous() for name, tensor in policy.named_parameters()}


def fill_network(policy: ActorCriticPolicy, tensors: dict[str, Tensor], where: Path) -> None:
    """Put weights into a network. Raises `AgentError` naming the file `where` if they do not fit it."""
    own = network_tensors(policy)
    for name in sorted(own.keys() | tensors.keys()):
        expected, found = (tuple(part[name].shape) if name in part else None for part in (own, tensors))
        require(expected == found, f"{where}: {name} must have shape {expected}, got {found}")
        own[name].copy_(tensors[name])


def load_policy(path: Path) -> ActorCriticPolicy:
    """Read what `save_policy` wrote. Raises `AgentError` naming the file if it is anything else."""
    tensors, description = read_tensors(path, AGENT_LAYOUT)
    policy = build_policy(
        _dict_space(description["observation"]), _box(description["action"]), description["architecture"]
    )
    fill_network(policy, tensors, path)
    policy.set_training_mode(False)
    return policy


def _dict_space(boxes: dict[str, dict[str, list[float]]]) -> spaces.Dict:
    from gymnasium import spaces

    return spaces.Dict({key: _box(bounds) for key, bounds in boxes.items()})


def _box(bounds: dict[str, list[float]]) -> spaces.Box:
    from gymnasium import spaces

    return spaces.Box(np.asarray(bounds["low"], np.float32), np.asarray(bounds["high"], np.float32), dtype=np.float32)
