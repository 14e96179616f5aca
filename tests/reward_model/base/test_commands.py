"""Exit statuses, and what stands on stderr."""

import subprocess
import sys
from dataclasses import dataclass

import pytest

from reward_model.base.commands import check_least, exit_status, run_command


@dataclass(frozen=True)
class Add:
    """Add numbers up."""

    numbers: tuple[int, ...]
    """What to add."""
    least: int = 0

    def run(self) -> int | None:
        check_least(self, least=0)
        print(sum(self.numbers))
        return None


@dataclass(frozen=True)
class Differ:
    """Find a difference."""

    def run(self) -> int:
        return 1


def raising(error: BaseException):
    def action() -> None:
        raise error

    return action


def test_a_command_runs_with_its_options(capsys):
    assert run_command("python add.py", Add, ["--numbers", "1", "2"]) == 0
    assert capsys.readouterr() == ("3\n", "")


def test_of_several_commands_the_named_one_runs_and_its_status_counts(capsys):
    commands = {"add": Add, "differ": Differ}
    assert run_command("python -m sums", commands, ["differ"]) == 1
    assert run_command("python -m sums", commands, ["add", "--numbers", "5"]) == 0
    assert capsys.readouterr() == ("5\n", "")
    assert run_command("python -m sums", {"differ": Differ}, ["differ"]) == 1


def test_help_names_the_program_and_says_what_it_does(capsys):
    for description, text in ((None, "Add numbers up."), ("Sums in general.", "Sums in general.")):
        with pytest.raises(SystemExit) as caught:
            run_command("python -m sums", Add, ["--help"], description)
        assert caught.value.code == 0
        printed = capsys.readouterr().out
        assert "usage: python -m sums" in printed
        assert text in printed
        assert "What to add." in printed


def test_unknown_options_are_explained(capsys):
    with pytest.raises(SystemExit) as caught:
        run_command("python -m sums", Add, ["--number", "1"])
    assert caught.value.code == 2
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("error", "status", "printed"),
    [
        (ValueError("n must be 1, got 2"), 2, "sums: n must be 1, got 2\n"),
        (ValueError("a.json: broken\n\nb.json: broken\n"), 2, "sums: a.json: broken\nsums: b.json: broken\n"),
        (ValueError(), 2, "sums: ValueError\n"),
        (FileNotFoundError(2, "No such file or directory", "a.json"), 2, "sums: a.json: No such file or directory\n"),
        (OSError(28, "No space left on device"), 2, "sums: [Errno 28] No space left on device\n"),
        (KeyboardInterrupt(), 130, "sums: interrupted\n"),
    ],
)
def test_what_the_user_can_put_right_is_told_without_a_traceback(error, status, printed, capsys):
    assert exit_status("python -m sums", raising(error)) == status
    assert capsys.readouterr() == ("", printed)


@pytest.mark.parametrize("error", [TypeError("no number"), AssertionError(), KeyError("n"), SystemExit(3)])
def test_programming_errors_keep_their_traceback(error):
    with pytest.raises(type(error)):
        exit_status("python -m sums", raising(error))


def test_options_below_their_least_value_are_named(capsys):
    assert run_command("python add.py", Add, ["--numbers", "1", "--least", "-1"]) == 2
    assert capsys.readouterr() == ("", "add.py: least must be at least 0, got -1\n")


@pytest.mark.parametrize("lines", [1, 100_000])  # the first are printed when the command is over
def test_a_reader_that_leaves_early_is_no_error(lines):
    code = (
        "import sys\nfrom reward_model.base.commands import exit_status\nsys.stdin.read()\n"
        f"sys.exit(exit_status('python -m sums', lambda: print('sum\\n' * {lines})))"
    )
    command = [sys.executable, "-c", code]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        process.stdin.close()
        assert process.stderr.read() == b""
    assert process.returncode == 0


def test_importing_it_loads_nothing_heavy():
    code = "import sys, reward_model.base.commands\nassert not {'torch', 'dgl', 'numba', 'numpy'} & sys.modules.keys()"
    outcome = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert outcome.returncode == 0, outcome.stderr
