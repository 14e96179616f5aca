"""A small stand-in for SocNav2-v0: a disc in an empty room drives to a goal about a metre away.

It has the layout of the `entities` observation, `info` and `episode_metrics` of the real environment.
"""

from __future__ import annotations

from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, SyncVectorEnv

CAPACITIES = {"people": 3, "objects": 2, "walls": 6, "interactions": 2}
WIDTHS = {"people": 8, "objects": 6, "walls": 4, "interactions": 4}
PERIOD = 0.2  # s
MAX_SPEED, MAX_TURN_RATE = 3.5 / 9.4, 4 / 10.32  # m/s, rad/s
ROOM = 3.0  # m, half a side
CORNERS = np.array([[ROOM, ROOM], [-ROOM, ROOM], [-ROOM, -ROOM], [ROOM, -ROOM]])


def entities_space() -> spaces.Dict:
    boxes: dict[str, spaces.Space[Any]] = {"robot": _box(4), "goal": _box(2)}
    for kind, capacity in CAPACITIES.items():
        boxes[kind] = _box(capacity * WIDTHS[kind])
        boxes[f"{kind}_mask"] = spaces.Box(0.0, 1.0, (capacity,), np.float32)
    return spaces.Dict(boxes)


class DiscEnv(gym.Env[dict[str, np.ndarray], np.ndarray]):
    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["rgb_array"], "render_fps": 5}

    def __init__(self, steps: int = 60, distance: float = 1.0, render_mode: str | None = None) -> None:
        self.observation_space = entities_space()
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.steps, self.distance, self.render_mode = steps, distance, render_mode

    @classmethod
    def vector(cls, num_envs: int, num_workers: int, action_repeat: int) -> SyncVectorEnv:
        assert action_repeat == 1
        return SyncVectorEnv([cls] * num_envs, autoreset_mode=AutoresetMode.SAME_STEP)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        self.pose = np.zeros(3)
        bearing = self.np_random.uniform(-np.pi, np.pi)
        self.goal = self.distance * np.array([np.cos(bearing), np.sin(bearing)])
        self.velocity, self.count = np.zeros(2), 0
        return self._observe(), {}

    def step(self, action: np.ndarray) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        self.velocity = np.clip(action, -1, 1) * (MAX_SPEED, MAX_TURN_RATE)
        before = np.linalg.norm(self.goal - self.pose[:2])
        heading = self.pose[2] + self.velocity[1] * PERIOD / 2
        self.pose[:2] += self.velocity[0] * PERIOD * np.array([np.cos(heading), np.sin(heading)])
        self.pose[2] += self.velocity[1] * PERIOD
        self.count += 1
        distance = np.linalg.norm(self.goal - self.pose[:2])
        arrived, late = bool(distance < 0.3), self.count >= self.steps
        progress = float(before - distance)
        reward = progress / (MAX_SPEED * PERIOD) - 1.0 + 10.0 * arrived
        info: dict[str, Any] = {"q2": 0.5, "is_success": arrived, "outcome": None}
        if arrived or late:
            info["outcome"] = "arrived" if arrived else "timeout"
            time = self.count * PERIOD if arrived else float("nan")
            info["episode_metrics"] = {"success": float(arrived), "time_to_goal": time, "q2_mean": 0.5}
        return self._observe(), reward, arrived, late and not arrived, info

    def render(self) -> Any:
        return np.full((32, 32, 3), self.count % 256, np.uint8)

    def _observe(self) -> dict[str, np.ndarray]:
        cosine, sine = np.cos(self.pose[2]), np.sin(self.pose[2])
        rotation = np.array([[cosine, -sine], [sine, cosine]])
        observation = {key: np.zeros(box.shape, np.float32) for key, box in self.observation_space.items()}
        observation["robot"][:] = (self.velocity[0], 0.0, self.velocity[1], 1 - self.count / self.steps)
        observation["goal"][:] = (self.goal - self.pose[:2]) @ rotation
        corners = (CORNERS - self.pose[:2]) @ rotation
        observation["walls"][:16] = np.hstack([corners, np.roll(corners, -1, axis=0)]).ravel()
        observation["walls_mask"][:4] = 1.0
        return observation


def _box(width: int) -> spaces.Box:
    return spaces.Box(-20.0, 20.0, (width,), np.float32)
