"""The options of all networks as fields of a dataclass, which tyro turns into flags of a command.

    @dataclass(frozen=True)
    @with_options
    class Train: ...

An option that several networks have is one field, so it must be the same for all of them.
"""

from __future__ import annotations

from typing import Annotated, Any, TypeVar

import tyro

from reward_model.networks.registry import NETWORKS, OptionField

Class = TypeVar("Class")


def with_options(cls: type[Class]) -> type[Class]:
    """Add a field for the value of every option."""
    for name, field in all_options().items():
        _add_field(cls, name, field.type, field.default)
    return cls


def with_option_ranges(cls: type[Class]) -> type[Class]:
    """Add a field for the range that a search draws every option from; for one that it does not draw, the value."""
    for name, field in all_options().items():
        if field.option.search is None:
            _add_field(cls, name, field.type, field.default)
        else:
            _add_field(cls, name, tuple[field.type, field.type], field.option.search)  # type: ignore[name-defined]
    return cls


def all_options() -> dict[str, OptionField]:
    """The options of all networks by name. Raises `ValueError` where one is not the same for two of them."""
    found: dict[str, OptionField] = {}
    for kind, network in NETWORKS.items():
        for name, field in network.config.option_fields().items():
            if found.setdefault(name, field) != field:
                raise ValueError(f"option {name} must be the same for all networks that have it, got another of {kind}")
    return found


def _add_field(cls: type, name: str, field_type: Any, default: Any) -> None:
    kinds = [kind for kind, network in NETWORKS.items() if name in network.config.option_fields()]
    if name in cls.__annotations__:
        raise ValueError(f"option {name} of {kinds[0]} must have another name, {cls.__name__} has a field of that name")
    text = f"Of {', '.join(kinds)}: {all_options()[name].option.help}."
    cls.__annotations__[name] = Annotated[field_type, tyro.conf.arg(help=text)]
    setattr(cls, name, default)
