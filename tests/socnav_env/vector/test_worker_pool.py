import os
import signal

import pytest

from socnav_env.vector.worker_pool import WorkerError, WorkerPool


class Unpicklable(Exception):
    def __init__(self, one, other) -> None:
        super().__init__(f"{one} and {other}")


class Counter:
    def __init__(self) -> None:
        self.count = 0

    def add(self, number: int, times: int = 1) -> int:
        self.count += number * times
        return self.count

    def fail(self, kind: type[Exception], *arguments) -> None:
        raise kind(*arguments)

    def end(self) -> None:
        os.kill(os.getpid(), signal.SIGKILL)

    def close(self) -> None:
        pass


@pytest.fixture
def pool():
    pool = WorkerPool([Counter] * 2)
    yield pool
    pool.close()
    pool.close()


def test_objects_keep_their_state_and_their_errors_come_here(pool) -> None:
    assert len(pool) == 2
    assert pool.ask(1, "add", 2, times=3) == 6
    assert pool.ask_all("add", [(1,), (1,)]) == [1, 7]
    with pytest.raises(KeyError, match="lost") as raised:
        pool.ask_all("fail", [(KeyError, "lost"), (ValueError, "found")])
    assert "in fail" in str(raised.value.__cause__)
    with pytest.raises(WorkerError, match="Unpicklable: one and two"):
        pool.ask(0, "fail", Unpicklable, "one", "two")
    assert pool.ask_all("add", [(0,), (0,)]) == [1, 7]  # answers are still in step
    with pytest.raises(WorkerError, match="worker process 1 ended unexpectedly"):
        pool.ask(1, "end")
