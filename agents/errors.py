"""The error that a command of this package reports to its user in one line."""

from __future__ import annotations


class AgentError(ValueError):
    """Something the user asked for cannot be done. The message gives the rule, the value and the remedy."""


def require(holds: bool, message: str) -> None:
    """Raise `AgentError` with the message unless the rule holds."""
    if not holds:
        raise AgentError(message)
