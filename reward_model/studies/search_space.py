"""What a random search draws hyperparameters from, by default the ranges of Bachiller et al. 2021."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal, NamedTuple

import numpy as np
import optuna

from reward_model.graph.features import NUM_NODE_FEATURES
from reward_model.networks.checkpoint import NetworkConfig
from reward_model.training.fit import TrainingConfig

Block = Literal["rgcn", "gat", "mpnn"]
BLOCKS: Final[tuple[Block, ...]] = ("rgcn", "gat", "mpnn")
_LAST_HIDDEN: Final = 3  # features of the last hidden layer


class Draw(NamedTuple):
    """One session's hyperparameters, as Optuna keeps them."""

    params: dict[str, Any]
    distributions: dict[str, optuna.distributions.BaseDistribution]


@dataclass(frozen=True)
class SearchSpace:
    """Ranges to draw from, both ends included; sessions take the blocks in turn."""

    blocks: tuple[Block, ...] = BLOCKS
    """Networks to search among."""
    edge_network: Literal["tabulated", "perceptron"] = "tabulated"
    """Of mpnn: ours, or the paper's."""
    batch_size: tuple[int, int] = (25, 70)
    """Windows."""
    hidden_units: tuple[int, int] = (20, 90)
    """Of the first hidden layer (of gat: of each head); the others fall in equal steps to 3, as in the paper's best."""
    layers: tuple[int, int] = (3, 9)
    """The last one included."""
    learning_rate: tuple[float, float] = (1e-4, 5e-4)
    """At the beginning."""
    weight_decay: tuple[float, float] = (0.0, 1e-6)
    """Of AdamW."""
    num_heads: tuple[int, int] = (3, 10)
    """Of gat."""
    negative_slope: tuple[float, float] = (0.1, 0.3)
    """Of gat's attention, the paper's alpha."""
    num_bases: tuple[int, int] = (4, 24)
    """Of rgcn."""
    dropout: tuple[float, float] = (0.0, 1e-6)
    """Of gat and rgcn."""
    max_epochs: int = 1000
    """Of every session."""
    patience: int = 4
    """Epochs without a better development error before a session ends."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if isinstance(value, tuple) and name != "blocks" and not 0 <= value[0] <= value[1]:
                raise ValueError(f"{name} must be a range from low to high, not below 0, got {value[0]} {value[1]}")
        if not self.blocks or len(set(self.blocks)) < len(self.blocks):
            raise ValueError(f"blocks must name at least one network, each once, got {list(self.blocks)}")
        for name in ("batch_size", "hidden_units", "num_heads", "num_bases"):
            if getattr(self, name)[0] < 1:
                raise ValueError(f"{name} must be at least 1, got {getattr(self, name)[0]}")
        if self.layers[0] < 2:
            raise ValueError(f"layers must be at least 2, got {self.layers[0]}")

    def draw(self, seed: int, number: int) -> Draw:
        """The hyperparameters of a session: they follow from the seed and its number alone."""
        (own_seed,) = np.random.SeedSequence([seed, number]).generate_state(1)
        sampler = optuna.samplers.RandomSampler(seed=int(own_seed))
        trial = optuna.create_study(sampler=sampler).ask()
        block = self.blocks[number % len(self.blocks)]
        for name in ("batch_size", "hidden_units", "layers", *(("num_heads",) if block == "gat" else ())):
            trial.suggest_int(name, *getattr(self, name))
        if block == "rgcn":
            trial.suggest_int("num_bases", *self.num_bases)
        for name in ("learning_rate", "weight_decay"):
            trial.suggest_float(name, *getattr(self, name))
        if block != "mpnn":
            trial.suggest_float("dropout", *self.dropout)
        if block == "gat":
            trial.suggest_float("negative_slope", *self.negative_slope)
        one_of = optuna.distributions.CategoricalDistribution(self.blocks)
        return Draw({"block": block, **trial.params}, {"block": one_of, **trial.distributions})

    def network(self, params: Mapping[str, Any]) -> NetworkConfig:
        """The network that drawn hyperparameters describe."""
        hidden = np.linspace(params["hidden_units"], min(_LAST_HIDDEN, params["hidden_units"]), params["layers"] - 1)
        sizes = (NUM_NODE_FEATURES, *hidden.astype(int).tolist(), 2)
        own = {name: params[name] for name in ("num_heads", "negative_slope", "num_bases", "dropout") if name in params}
        edge_network = self.edge_network if params["block"] == "mpnn" else ""
        return NetworkConfig(params["block"], sizes, edge_network, **own)

    def training(self, params: Mapping[str, Any], number: int, device: str) -> TrainingConfig:
        """How a session with drawn hyperparameters trains."""
        rates = (params["learning_rate"], params["weight_decay"])
        return TrainingConfig(self.max_epochs, self.patience, params["batch_size"], *rates, number, device)
