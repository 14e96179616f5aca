"""SocNav2-v0: a robot crosses a room among people. Importing this package registers the environment.

The environment itself is loaded by `gym.make`; this import is light.
"""

import gymnasium as gym

from socnav_env.config import (
    ConfigError,
    EnvConfig,
    PeopleConfig,
    PopulationConfig,
    RewardConfig,
    RobotConfig,
    RoomConfig,
    SensorConfig,
)

__all__ = [
    "ConfigError",
    "EnvConfig",
    "PeopleConfig",
    "PopulationConfig",
    "RewardConfig",
    "RobotConfig",
    "RoomConfig",
    "SensorConfig",
]

# No max_episode_steps: the environment knows its own time limit.
gym.register(
    "SocNav2-v0",
    entry_point="socnav_env.env:SocNavEnv",
    vector_entry_point="socnav_env.vector.make:make_vector_env",
)
