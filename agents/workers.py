"""Environments spread over a few processes, several in each.

SB3's `SubprocVecEnv` runs one process per environment and exchanges one message per environment and step. With
more environments than cores that is mostly overhead; here a step costs one message per process.
"""

from __future__ import annotations

import multiprocessing
import signal
import traceback
from collections.abc import Callable, Iterable, Sequence
from multiprocessing.connection import Connection
from typing import Any

import gymnasium as gym
import numpy as np
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

VecEnvMaker = Callable[[int], VecEnv]
"""Returns a vector environment of as many environments as it is told. Can be pickled to another process."""


class WorkerVecEnv(VecEnv):
    """SB3's vector environment over `num_workers` processes.

    The observation is a Dict of Boxes. An error in a worker is raised here, with the worker's traceback.

    Args:
        make: makes the part of one process.
        num_envs: how many environments.
        num_workers: how many processes share them, as evenly as can be.

    """

    def __init__(self, make: VecEnvMaker, num_envs: int, num_workers: int) -> None:
        shares = np.array_split(np.arange(num_envs), num_workers)
        self._slices = [slice(int(share[0]), int(share[-1]) + 1) for share in shares]
        context = multiprocessing.get_context("forkserver")
        self._connections: list[Connection] = []
        self._processes = []
        for part in self._slices:
            ours, theirs = context.Pipe()
            process = context.Process(target=_serve, args=(theirs, make, part.stop - part.start), daemon=True)
            process.start()
            theirs.close()
            self._connections.append(ours)
            self._processes.append(process)
        self._closed = False
        observation_space, action_space = self._ask(0, "spaces")
        super().__init__(num_envs, observation_space, action_space)

    def reset(self) -> VecEnvObs:
        """Reset all environments and return their first observations."""
        self._send_all("reset", [(self._seeds[part], self._options[part]) for part in self._slices])
        answers = self._receive_all()
        self.reset_infos = [info for _, infos in answers for info in infos]
        self._reset_seeds()
        self._reset_options()
        return _join([observations for observations, _ in answers])

    def step_async(self, actions: np.ndarray[Any, Any]) -> None:
        """Send every worker the actions of its environments."""
        self._send_all("step", [actions[part] for part in self._slices])

    def step_wait(self) -> VecEnvStepReturn:
        """Gather what the workers answer: observations, rewards, dones and infos."""
        observations, rewards, dones, infos, reset_infos = zip(*self._receive_all(), strict=True)
        self.reset_infos = [info for part in reset_infos for info in part]
        return (
            _join(observations),
            np.concatenate(rewards),
            np.concatenate(dones),
            [info for part in infos for info in part],
        )

    def close(self) -> None:
        """End the workers."""
        if self._closed:
            return
        self._closed = True
        for connection in self._connections:
            try:
                connection.send(("close", None))
                connection.close()
            except OSError:  # the worker is gone already
                continue
        for process in self._processes:
            process.join(timeout=5)
            if process.is_alive():
                process.terminate()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute of each environment."""
        return self._ask_each("get_attr", indices, attr_name)

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of each environment."""
        self._ask_each("set_attr", indices, attr_name, value)

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any) -> list[Any]:
        """Call a method of each environment."""
        return self._ask_each("env_method", indices, method_name, *method_args, **method_kwargs)

    def env_is_wrapped(self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: Any = None) -> list[bool]:
        """Return whether each environment is wrapped in `wrapper_class`."""
        return self._ask_each("env_is_wrapped", indices, wrapper_class)

    def _ask_each(self, method: str, indices: Any, *args: Any, **kwargs: Any) -> list[Any]:
        wanted = list(self._get_indices(indices)) if indices is not None else None
        answers: list[Any] = []
        for worker, part in enumerate(self._slices):
            own = [i - part.start for i in range(part.start, part.stop) if wanted is None or i in wanted]
            if own:
                answers.extend(self._ask(worker, "call", (method, args, {**kwargs, "indices": own})) or ())
        return answers

    def _ask(self, worker: int, command: str, data: Any = None) -> Any:
        self._connections[worker].send((command, data))
        return self._receive(self._connections[worker])

    def _send_all(self, command: str, data: Iterable[Any]) -> None:
        for connection, part in zip(self._connections, data, strict=True):
            connection.send((command, part))

    def _receive_all(self) -> list[Any]:
        return [self._receive(connection) for connection in self._connections]

    def _receive(self, connection: Connection) -> Any:
        try:
            succeeded, answer = connection.recv()
        except (EOFError, ConnectionResetError) as error:
            raise RuntimeError("an environment's worker process ended unexpectedly") from error
        if not succeeded:
            raise RuntimeError(f"an environment's worker process failed:\n{answer}")
        return answer


def _serve(connection: Connection, make: VecEnvMaker, num_envs: int) -> None:
    """Answer commands about this worker's environments until told to close."""
    import torch

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides when to stop
    torch.set_num_threads(1)
    envs: VecEnv | None = None
    while True:
        try:
            command, data = connection.recv()
        except EOFError:
            break
        if command == "close":
            break
        try:
            if envs is None:
                envs = make(num_envs)
            answer = True, _answer(envs, command, data)
        except Exception:
            answer = False, traceback.format_exc()
        connection.send(answer)
    if envs is not None:
        envs.close()


def _answer(envs: VecEnv, command: str, data: Any) -> Any:
    if command == "step":
        observations, rewards, dones, infos = envs.step(data)
        return observations, rewards, dones, infos, envs.reset_infos
    if command == "reset":
        envs._seeds, envs._options = data
        return envs.reset(), envs.reset_infos
    if command == "spaces":
        return envs.observation_space, envs.action_space
    method, args, kwargs = data
    return getattr(envs, method)(*args, **kwargs)


def _join(parts: Sequence[Any]) -> dict[str, np.ndarray[Any, Any]]:
    assert isinstance(parts[0], dict), "the observation space is a Dict"
    return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
