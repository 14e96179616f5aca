"""What a training run is: every number a user can set, with what it means."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, fields
from typing import Any, TypeVar

from agents.storage import require

Config = TypeVar("Config", bound="PPOConfig | RunConfig")


@dataclass(frozen=True)
class PPOConfig:
    """Hyperparameters of PPO, under Stable-Baselines3's names."""

    n_steps: int = 32
    """Actions each environment takes between two updates."""
    batch_size: int = 256
    """Samples of one gradient step."""
    n_epochs: int = 10
    """Passes over the samples of one update."""
    learning_rate: float = 1e-3
    """Step size of Adam at the start; it falls linearly to a tenth at the end of training."""
    gamma: float = 0.97
    """Discount per action."""
    gae_lambda: float = 0.95
    """Trade-off of bias and variance in the advantages (Schulman et al. 2016)."""
    clip_range: float = 0.2
    """How far one update may move an action's probability ratio from 1."""
    ent_coef: float = 0.0
    """Weight of the entropy bonus."""
    vf_coef: float = 0.5
    """Weight of the value function's loss."""
    max_grad_norm: float = 0.5
    """Gradients longer than this are shortened to it."""
    log_std_init: float = -0.5
    """Logarithm of the actions' standard deviation at the start."""
    entity_width: int = 32
    """Numbers that encode one entity."""
    net_arch: tuple[int, ...] = (64, 64)
    """Hidden layers of the actor, and of the critic, on top of the pooled entities."""


@dataclass(frozen=True)
class RunConfig:
    """One training run."""

    total_timesteps: int = 700_000
    """Control steps to train for, all environments together."""
    reward: str = "learned"
    """Reward to train with, by name, or a mix such as learned+0.5*crowdnav."""
    weights: str = "default"
    """Weights of the learned reward: default, published or a path."""
    num_envs: int = 32
    """Environments that run side by side."""
    action_repeat: int = 4
    """Control steps that an action lasts in training; trained agents act anew in each."""
    num_workers: int = 2
    """Processes the environments are spread over; 0 runs them all in this one."""
    seed: int = 0
    """Seed of the networks, the exploration and the episodes."""
    eval_episodes: int = 100
    """Episodes of the evaluation at the end."""
    evaluation_interval: int = 50_000
    """Timesteps between two evaluations during training."""
    evaluation_episodes: int = 20
    """Episodes of each evaluation during training."""
    checkpoint_interval: int = 25_000
    """Timesteps between two checkpoints."""
    scenario: str | None = None
    """Where episodes begin: a scenario's name or file; without one in rooms drawn at random."""
    environment: dict[str, Any] = field(default_factory=dict)
    """The environment's configuration where it differs from the default, as `EnvConfig.from_dict` reads it."""
    ppo: PPOConfig = PPOConfig()
    """Hyperparameters of PPO."""

    def __post_init__(self) -> None:
        for name in (
            "total_timesteps",
            "num_envs",
            "action_repeat",
            "eval_episodes",
            "evaluation_interval",
            "evaluation_episodes",
            "checkpoint_interval",
        ):
            require(getattr(self, name) >= 1, f"{name} must be at least 1, got {getattr(self, name)}")
        for name in ("num_workers", "seed"):
            require(getattr(self, name) >= 0, f"{name} must not be negative, got {getattr(self, name)}")
        _check_ppo(self.ppo)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values that JSON can hold; `from_dict` is the inverse."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any], where: str) -> RunConfig:
        """Build the config that `to_dict` gave. Raises `AgentError` on unknown keys, naming the file `where`."""
        ppo = dict(values.get("ppo", {}))
        ppo["net_arch"] = tuple(ppo.get("net_arch", PPOConfig.net_arch))
        return _build(cls, {**values, "ppo": _build(PPOConfig, ppo, f"{where}: ppo")}, where)


def _build(cls: type[Config], values: dict[str, Any], where: str) -> Config:
    known = {item.name for item in fields(cls)}
    unknown = sorted(set(values) - known)
    require(not unknown, f"{where}: unknown key {', '.join(unknown)}; valid are {', '.join(sorted(known))}")
    return cls(**values)


def _check_ppo(ppo: PPOConfig) -> None:
    require(ppo.n_steps >= 2, f"ppo.n_steps must be at least 2, got {ppo.n_steps}")
    for name in ("batch_size", "n_epochs", "entity_width"):
        require(getattr(ppo, name) >= 1, f"ppo.{name} must be at least 1, got {getattr(ppo, name)}")
    for name in ("learning_rate", "clip_range", "max_grad_norm"):
        require(getattr(ppo, name) > 0, f"ppo.{name} must be above 0, got {getattr(ppo, name)}")
    for name in ("gamma", "gae_lambda"):
        require(0 <= getattr(ppo, name) <= 1, f"ppo.{name} must be from 0 to 1, got {getattr(ppo, name)}")
    for name in ("ent_coef", "vf_coef"):
        require(getattr(ppo, name) >= 0, f"ppo.{name} must not be negative, got {getattr(ppo, name)}")
    require(
        all(width >= 1 for width in ppo.net_arch),
        f"ppo.net_arch must hold widths of at least 1, got {ppo.net_arch}",
    )
