"""What every command line of the project shares: options of dataclasses, exit statuses, errors in one line."""

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
    """What can be run; its fields are its options and its docstring is its help."""

    def run(self) -> int | None:
        """Do it; returns the exit status, None for 0.

        Raises `ValueError` with a line for each problem, or `OSError`, for what the user can put right.
        """
        ...


def run_command(
    program: str,
    commands: type[Command] | Mapping[str, type[Command]],
    arguments: Sequence[str] | None = None,
    description: str | None = None,
) -> int:
    """Parse a command line, run the command that it asks for and return its exit status, see `exit_status`.

    Args:
        program: how the user calls it, such as `python -m reward_model`.
        commands: the command, or several by their names.
        arguments: the command line without the program; the process's own where None.
        description: what `--help` says of the program; of a single command, its docstring where None.

    Raises:
        SystemExit: after `--help` (0), and where options are not the commands' (2), which tyro has then explained.

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
    """Run what a command does and return its exit status.

    That is the action's own, 0 where it is None or nobody reads the output any more, 2 after a `ValueError` or
    `OSError`, which stderr then holds without its traceback, and 130 after Ctrl-C. All other errors are raised.
    """
    try:
        status = action()
        sys.stdout.flush()
    except BrokenPipeError:  # whoever reads our output has seen enough
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
    """What its user calls it for short: `reward_model` for `python -m reward_model`."""
    return program.split()[-1]
