"""The networks by name: the options of each, and where its class and its compiled code are.

A network is a config class and an entry of `NETWORKS` here, and the files that the entry names. Checkpoints, the flags
of the command line, random search, training and scoring follow from these. Nothing here loads PyTorch or DGL.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    Final,
    Literal,
    NamedTuple,
    TypeAlias,
    get_args,
    get_type_hints,
)


@dataclass(frozen=True)
class Option:
    """What holds for an option of a network, beside its type and its default.

    Attributes:
        help: what it is, without a full stop
        search: the range that a random search draws from by default, both ends included; None where it draws none
        at_least, below: bounds of a number
    """

    help: str
    search: tuple[float, float] | None = None
    at_least: int = 0
    below: float = math.inf


class OptionField(NamedTuple):
    """An option as a field of a config class: its type is int, float or a Literal of strings."""

    type: Any
    default: Any
    option: Option

    @property
    def choices(self) -> list[str]:
        """The values that a Literal allows, none for a number."""
        return sorted(get_args(self.type))

    def check(self, name: str, value: Any) -> None:
        """Raise `ValueError` for a value that the option cannot have."""
        low, high = self.option.at_least, self.option.below
        if self.choices and value not in self.choices:
            raise ValueError(f"{name} must be one of {self.choices}, got {value!r}")
        if not self.choices and not low <= value < high:
            bounds = f"be at least {low}" if high == math.inf else f"lie in {low}..{high:g}, {high:g} excluded"
            raise ValueError(f"{name} must {bounds}, got {value}")


@dataclass(frozen=True)
class NetworkConfig:
    """What is needed to build a network before its weights are loaded; a class for each network adds its options.

    Attributes:
        kind: its name in `NETWORKS`
        sizes: features of the nodes, of every hidden layer, and of the output (Q1 and Q2)

    Raises:
        ValueError: For sizes or options that no network can have.
    """

    kind: ClassVar[str]
    sizes: tuple[int, ...]

    def __post_init__(self) -> None:
        from reward_model.graph.features import NUM_NODE_FEATURES  # which loads NumPy

        if len(self.sizes) < 2 or self.sizes[0] != NUM_NODE_FEATURES or self.sizes[-1] != 2:
            raise ValueError(f"sizes must run from {NUM_NODE_FEATURES} to 2, got {list(self.sizes)}")
        for name, field in self.option_fields().items():
            field.check(name, getattr(self, name))

    @classmethod
    def option_fields(cls) -> dict[str, OptionField]:
        """The network's options by name."""
        hints = get_type_hints(cls, include_extras=True)
        annotated = {field.name: (get_args(hints[field.name]), field) for field in fields(cls) if field.name != "sizes"}
        return {name: OptionField(args[0], field.default, args[1]) for name, (args, field) in annotated.items()}

    def options(self) -> dict[str, Any]:
        """The values of the network's options by name."""
        return {name: getattr(self, name) for name in self.option_fields()}

    def document(self) -> dict[str, Any]:
        """The config as a checkpoint's JSON has it."""
        return {"kind": self.kind, "sizes": list(self.sizes)} | self.options()


Dropout = Annotated[float, Option("share of features dropped in training", search=(0.0, 1e-6), below=1)]


@dataclass(frozen=True)
class RGCNConfig(NetworkConfig):
    """See `reward_model.networks.rgcn`."""

    kind: ClassVar[str] = "rgcn"
    num_bases: Annotated[int, Option("matrices that all relations' are mixed from", search=(4, 24), at_least=1)] = 8
    dropout: Dropout = 0.0


@dataclass(frozen=True)
class GATConfig(NetworkConfig):
    """See `reward_model.networks.gat`; the hidden layers' sizes are those of every head."""

    kind: ClassVar[str] = "gat"
    num_heads: Annotated[int, Option("attention heads of every layer", search=(3, 10), at_least=1)] = 4
    negative_slope: Annotated[
        float, Option("slope below zero of the attention's leaky ReLU, the paper's alpha", search=(0.1, 0.3), below=1)
    ] = 0.2
    dropout: Dropout = 0.0


@dataclass(frozen=True)
class MPNNConfig(NetworkConfig):
    """See `reward_model.networks.mpnn`."""

    kind: ClassVar[str] = "mpnn"
    edge_network: Annotated[
        Literal["tabulated", "perceptron"], Option("tabulated is fast, perceptron is the paper's")
    ] = "tabulated"


@dataclass(frozen=True)
class StarConfig(NetworkConfig):
    """See `reward_model.networks.star`; each hidden size is that of a round."""

    kind: ClassVar[str] = "star"
    members: Annotated[int, Option("separate networks whose mean is the score", at_least=1, below=100)] = 1

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.sizes) < 3 or min(self.sizes[1:-1]) < 2:
            raise ValueError(f"a star network needs hidden sizes of at least 2, got {list(self.sizes[1:-1])}")


@dataclass(frozen=True)
class Network:
    """A kind of network.

    Definition, trained and compiled are `module:name`, imported when they are needed.

    Attributes:
        title: its name in tables
        config: the class of its options
        sees: what it sees of a graph's edges
        definition: its class, a `WindowNetwork` that is called with `sizes` and the options
        on_dgl: whether that runs on DGL
        trained: a class with the same parameters by name and shape that is trained in its place
        compiled: what scores on the CPU in compiled code, called with a checkpoint and the file that may keep what
            takes long to compute from the weights, or None; it returns a callable from windows to scores, (num_windows,
            2), and raises `CheckpointError` where the weights do not fit
    """

    title: str
    config: type[NetworkConfig]
    sees: str
    definition: str
    on_dgl: bool = False
    trained: str = ""
    compiled: str = ""

    @property
    def trained_on_dgl(self) -> bool:
        """Whether training needs DGL."""
        return self.on_dgl and not self.trained


NETWORKS: Final[Mapping[str, Network]] = {
    network.config.kind: network
    for network in (
        Network(
            "R-GCN",
            RGCNConfig,
            sees="relations",
            definition="reward_model.networks.rgcn:RGCN",
            on_dgl=True,
            compiled="reward_model.fast.from_checkpoint:compiled_rgcn",
        ),
        Network(
            "GAT",
            GATConfig,
            sees="only which nodes they join",
            definition="reward_model.networks.gat:GAT",
            on_dgl=True,
            compiled="reward_model.fast.from_checkpoint:compiled_gat",
        ),
        Network(
            "MPNN",
            MPNNConfig,
            sees="relations and lengths",
            definition="reward_model.networks.mpnn:MPNN",
            on_dgl=True,
            trained="reward_model.networks.factorised_mpnn:FactorisedMPNN",
            compiled="reward_model.fast.from_checkpoint:compiled_mpnn",
        ),
        Network(
            "Star",
            StarConfig,
            sees="interactions, and of the others their features in all frames",
            definition="reward_model.networks.star:StarNetwork",
            compiled="reward_model.fast.from_checkpoint:compiled_star",
        ),
    )
}

if TYPE_CHECKING:
    Kind: TypeAlias = str
else:
    Kind = Literal[tuple(NETWORKS)]  # from which the command line reads the choices


def network_config(kind: str, sizes: tuple[int, ...], options: Mapping[str, Any]) -> NetworkConfig:
    """The config of a network by name. Options that are not given have their defaults.

    Raises:
        ValueError: For an unknown name, an option of another network, or a value that it cannot have.
    """
    if kind not in NETWORKS:
        raise ValueError(f"network kind must be one of {sorted(NETWORKS)}, got {kind!r}")
    config = NETWORKS[kind].config
    own = config.option_fields()
    for name in options:
        if name not in own:
            raise ValueError(f"{name} is no option of {kind}, which takes {sorted(own)}")
    return config(sizes, **options)
