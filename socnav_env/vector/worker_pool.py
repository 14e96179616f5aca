"""Objects that live in processes of their own and answer calls of their methods, all of them at the same time."""

from __future__ import annotations

import multiprocessing
import pickle
import signal
import sys
import traceback
from collections.abc import Callable, Iterable, Sequence
from multiprocessing.connection import Connection
from typing import Any

Maker = Callable[[], Any]
"""Makes the object of one process. Can be pickled."""

PRELOADED = ["__main__", "socnav_env.vector.env"]  # modules that processes start with, without the time to load them
CLOSE_TIMEOUT = 5.0  # s that a process is given to end


class WorkerError(RuntimeError):
    """A worker process is gone, or raised an error that cannot be passed on; or says where in it one was raised."""


class WorkerPool:
    """A process for each maker, which makes its object there.

    What a method raises in a worker is raised here, with the worker's traceback as its cause. The processes are
    started afresh (not forked), so a script that makes a pool needs the usual `if __name__ == "__main__":`.

    Args:
        makers: of the objects
    """

    def __init__(self, makers: Sequence[Maker]) -> None:
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload(PRELOADED)
        self._connections: list[Connection] = []
        self._processes = []
        self._closed = False
        for maker in makers:
            ours, theirs = context.Pipe()
            process = context.Process(target=_serve, args=(theirs, maker), daemon=True)
            process.start()
            theirs.close()
            self._connections.append(ours)
            self._processes.append(process)

    def __len__(self) -> int:
        return len(self._connections)

    def ask(self, worker: int, method: str, *arguments: Any, **named: Any) -> Any:
        """Call a method of one worker's object and return what it returns."""
        self._send(worker, (method, arguments, named))
        return self._received([worker])[0]

    def ask_all(self, method: str, arguments: Iterable[Sequence[Any]] | None = None) -> list[Any]:
        """Call a method of every worker's object, each with its own arguments, and return what each returns."""
        self.tell_all(method, [()] * len(self) if arguments is None else arguments)
        return self.answers()

    def tell_all(self, method: str, arguments: Iterable[Sequence[Any]]) -> None:
        """Begin what `ask_all` does; `answers` ends it."""
        for worker, each in enumerate(arguments):
            self._send(worker, (method, tuple(each), {}))

    def answers(self) -> list[Any]:
        """Return what every worker's object returned."""
        return self._received(range(len(self)))

    def close(self) -> None:
        """End the processes."""
        if self._closed:
            return
        self._closed = True
        for connection in self._connections:
            try:
                connection.send(None)
                connection.close()
            except OSError:  # the worker is gone already
                continue
        for process in self._processes:
            process.join(timeout=CLOSE_TIMEOUT)
            if process.is_alive():
                process.terminate()

    def _send(self, worker: int, message: Any) -> None:
        try:
            self._connections[worker].send(message)
        except OSError as error:
            raise WorkerError(f"worker process {worker} ended unexpectedly") from error

    def _received(self, workers: Iterable[int]) -> list[Any]:
        """What workers answer; only when all have is the first error raised, so that the next answers are in step."""
        answers: list[Any] = []
        failures: list[tuple[Exception, WorkerError]] = []
        for worker in workers:
            try:
                failure, answer = self._connections[worker].recv()
            except (EOFError, OSError) as error:
                raise WorkerError(f"worker process {worker} ended unexpectedly") from error
            answers.append(answer)
            if failure:
                failures.append((answer, WorkerError(f"in worker process {worker}:\n{failure}")))
        if failures:
            raise failures[0][0] from failures[0][1]
        return answers


def _serve(connection: Connection, make: Maker) -> None:
    """Answer calls until told to close."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides when to stop
    made: list[Any] = []
    while True:
        try:
            message = connection.recv()
        except EOFError:
            break
        if message is None:
            break
        connection.send_bytes(_answer(made, make, message))
    for each in made:
        each.close()


def _answer(made: list[Any], make: Maker, message: tuple[str, tuple[Any, ...], dict[str, Any]]) -> bytes:
    """Call a method, of an object made before the first call, and pickle what it returns or raises."""
    method, arguments, named = message
    try:
        if not made:
            made.append(make())
            _use_one_thread()
        return pickle.dumps(("", getattr(made[0], method)(*arguments, **named)))
    except Exception as error:
        where = traceback.format_exc()
        try:
            answer = pickle.dumps((where, error))
            pickle.loads(answer)
        except Exception:  # errors with constructors of their own
            answer = pickle.dumps((where, WorkerError(f"{type(error).__name__}: {error}")))
        return answer


def _use_one_thread() -> None:
    """The processes share the cores already. PyTorch is not loaded for this where nothing else needs it."""
    if "torch" in sys.modules:
        sys.modules["torch"].set_num_threads(1)
