from dataclasses import dataclass, fields
from typing import Annotated, ClassVar, Literal

import pytest
import tyro

from reward_model.networks import option_fields
from reward_model.networks.option_fields import with_option_ranges, with_options
from reward_model.networks.registry import Network, NetworkConfig, Option

Heads = Annotated[int, Option("heads of every layer", search=(1, 4), at_least=1)]


@dataclass(frozen=True)
class First(NetworkConfig):
    kind: ClassVar[str] = "first"
    heads: Heads = 2
    norm: Annotated[Literal["layer", "none"], Option("after every layer")] = "none"


@dataclass(frozen=True)
class Second(NetworkConfig):
    kind: ClassVar[str] = "second"
    heads: Heads = 2


@dataclass(frozen=True)
class Other(NetworkConfig):
    kind: ClassVar[str] = "other"
    heads: Heads = 3


def register(monkeypatch, *configs):
    networks = {config.kind: Network(config.kind, config, "lengths", "") for config in configs}
    monkeypatch.setattr(option_fields, "NETWORKS", networks)


def test_every_option_is_one_field_with_its_help(monkeypatch, capsys):
    register(monkeypatch, First, Second)

    @dataclass(frozen=True)
    @with_options
    class Command:
        seed: int = 0

    assert [(field.name, field.default) for field in fields(Command)] == [("seed", 0), ("heads", 2), ("norm", "none")]
    assert tyro.cli(Command, args=["--heads", "3", "--norm", "layer"]) == Command(0, 3, "layer")
    with pytest.raises(SystemExit):
        tyro.cli(Command, args=["--help"])
    text = capsys.readouterr().out
    assert "Of first, second: heads of every layer." in text
    assert "Of first: after every layer." in text


def test_what_a_search_draws_is_a_range(monkeypatch):
    register(monkeypatch, First)

    @dataclass(frozen=True)
    @with_option_ranges
    class Space:
        pass

    assert Space() == Space((1, 4), "none")
    assert tyro.cli(Space, args=["--heads", "2", "3"]) == Space((2, 3), "none")


def test_options_of_one_name_are_the_same(monkeypatch):
    register(monkeypatch, First, Other)
    message = r"^option heads must be the same for all networks that have it, got another of other$"
    with pytest.raises(ValueError, match=message):
        with_options(type("Command", (), {"__annotations__": {}}))


def test_options_have_names_of_their_own(monkeypatch):
    register(monkeypatch, Second)
    message = r"^option heads of second must have another name, Command has a field of that name$"
    with pytest.raises(ValueError, match=message):
        with_options(type("Command", (), {"__annotations__": {"heads": int}}))
