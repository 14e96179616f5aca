"""Shared parts of the project's command lines: options of dataclasses, exit statuses, errors in one line."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Final, Protocol

import tyro

USER_ERROR: Final = 2
INTERRUPTED: Final = 130  # 128 and the number of SIGINT, as shells have it

Files = Annotated[tyro.conf.Positional[tuple[Path, ...]], tyro.conf.arg(metavar="FILE...", help_behavior_hint="")]
"""The type of a command's field that takes any number of files."""


class Command(Protocol):
    """A command; its fields are its options and its docstring is its help."""

    def run(self) -> int | None:
        """Run the command; returns the exit status, None for 0.

        Raises:
            ValueError: With a line for each problem, or `OSError`, for mistakes that the user can correct.
        """
        ...


def run_command(
    program: str,
    commands: type[Command] | Mapping[str, type[Command]],
    arguments: Sequence[str] | None = None,
    description: str | None = None,
) -> int:
    """Parse a command line, run its command and return the exit status, see `exit_status`.

    Args:
        program: the call of the program, such as `python -m reward_model`.
        commands: the command, or several by their names.
        arguments: the command line without the program; the process's own where None.
        description: description of the program in `--help`; where None, that of a single command is its docstring.

    Raises:
        SystemExit: after `--help` (0), and for invalid options (2), after tyro's explanation.
    """

    def action() -> int | None:
        if isinstance(commands, Mapping):
            parse = tyro.extras.subcommand_cli_from_dict
            command: Command = parse(dict(commands), prog=program, description=description, args=arguments)
        else:
            command = tyro.cli(commands, prog=program, description=description, args=arguments)
        return command.run()

    return exit_status(program, action)


def exit_status(program: str, action: Callable[[], int | None]) -> int:
    """Run a command's action and return its exit status.

    The status is the action's own, 0 where it is None or the reader of the output has closed it, 2 after a
    `ValueError` or `OSError`, which is printed on stderr without its traceback, and 130 after Ctrl-C. All other
    errors are raised.
    """
    try:
        status = action()
        sys.stdout.flush()
    except BrokenPipeError:  # the reader of the output has closed it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except (ValueError, OSError) as error:
        print_error(program, error)
        return USER_ERROR
    except KeyboardInterrupt:
        print(f"{_name(program)}: interrupted", file=sys.stderr)
        return INTERRUPTED
    return status or 0


def print_error(program: str, error: Exception) -> None:
    """Print an error's message on stderr, the program's name before each of its lines."""
    message = str(error) or type(error).__name__
    if isinstance(error, OSError) and error.filename is not None:
        message = f"{error.filename}: {error.strerror}"
    for line in filter(str.strip, message.splitlines()):
        print(f"{_name(program)}: {line}", file=sys.stderr)


def check_least(command: Command, **least: int) -> None:
    """Raise `ValueError` where an option is below the least value given for its name."""
    for name, value in least.items():
        if getattr(command, name) < value:
            raise ValueError(f"{name} must be at least {value}, got {getattr(command, name)}")


def _name(program: str) -> str:
    """The short name of a program: `reward_model` for `python -m reward_model`."""
    return program.split()[-1]
