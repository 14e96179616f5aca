"""What a random search draws hyperparameters from, by default the ranges of Bachiller et al. 2021.

The command line is made of it, so nothing here loads Optuna or PyTorch before a session is drawn.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from reward_model.networks.option_fields import all_options, with_option_ranges
from reward_model.networks.registry import NETWORKS, Kind, NetworkConfig, network_config

if TYPE_CHECKING:
    from optuna.distributions import BaseDistribution

    from reward_model.training.fit import TrainingConfig

_LAST_HIDDEN: Final = 3  # features of the last hidden layer


class Draw(NamedTuple):
    """One session's hyperparameters, as Optuna keeps them."""

    params: dict[str, Any]
    distributions: dict[str, BaseDistribution]


@dataclass(frozen=True)
@with_option_ranges
class SearchSpace:
    """Ranges to draw from, both ends included; sessions take the blocks in turn.

    Every option of a network has a field, too: the range to draw it from, or its value where none is drawn.

    Raises:
        ValueError: For ranges that nothing can be drawn from.
    """

    blocks: tuple[Kind, ...] = ("rgcn", "gat", "mpnn")
    """Networks to search among."""
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
        for name, least in (("batch_size", 1), ("hidden_units", 1), ("layers", 2)):
            if getattr(self, name)[0] < least:
                raise ValueError(f"{name} must be at least {least}, got {getattr(self, name)[0]}")
        for name, field in all_options().items():
            value = getattr(self, name)
            for each in (value,) if field.option.search is None else value:
                field.check(name, each)

    def document(self) -> dict[str, Any]:
        """What makes it this one: every field but the options of networks that are not searched among."""
        searched = {name for block in self.blocks for name in NETWORKS[block].config.option_fields()}
        others = all_options().keys() - searched
        return {name: value for name, value in asdict(self).items() if name not in others}

    def draw(self, seed: int, number: int) -> Draw:
        """The hyperparameters of a session: they follow from the seed and its number alone."""
        import numpy as np
        from optuna import create_study
        from optuna.distributions import CategoricalDistribution
        from optuna.samplers import RandomSampler

        (own_seed,) = np.random.SeedSequence([seed, number]).generate_state(1)
        trial = create_study(sampler=RandomSampler(seed=int(own_seed))).ask()
        block = self.blocks[number % len(self.blocks)]
        own = NETWORKS[block].config.option_fields()
        drawn = [name for name in sorted(own) if own[name].option.search is not None]
        for name in ("batch_size", "hidden_units", "layers", *(each for each in drawn if own[each].type is int)):
            trial.suggest_int(name, *getattr(self, name))
        for name in ("learning_rate", "weight_decay", *(each for each in drawn if own[each].type is float)):
            trial.suggest_float(name, *getattr(self, name))
        one_of = CategoricalDistribution(self.blocks)
        return Draw({"block": block, **trial.params}, {"block": one_of, **trial.distributions})

    def network(self, params: Mapping[str, Any]) -> NetworkConfig:
        """The network that drawn hyperparameters describe."""
        import numpy as np

        from reward_model.graph.features import NUM_NODE_FEATURES

        hidden = np.linspace(params["hidden_units"], min(_LAST_HIDDEN, params["hidden_units"]), params["layers"] - 1)
        sizes = (NUM_NODE_FEATURES, *hidden.astype(int).tolist(), 2)
        options = {
            name: getattr(self, name) if field.option.search is None else params[name]
            for name, field in NETWORKS[params["block"]].config.option_fields().items()
        }
        return network_config(params["block"], sizes, options)

    def training(self, params: Mapping[str, Any], number: int, device: str) -> TrainingConfig:
        """How a session with drawn hyperparameters trains."""
        from reward_model.training.fit import TrainingConfig

        rates = (params["learning_rate"], params["weight_decay"])
        return TrainingConfig(self.max_epochs, self.patience, params["batch_size"], *rates, number, device)
