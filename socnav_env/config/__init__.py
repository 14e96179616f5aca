"""The configuration: frozen dataclasses that refuse unknown keys and invalid values.

SI units throughout: metres, seconds, radians. A range is a pair (least, most), both included. Imports nothing else of
this package.
"""

from socnav_env.config.checks import ConfigError
from socnav_env.config.env import EnvConfig
from socnav_env.config.people import MAX_HASTE, GroupConfig, OrcaConfig, PeopleConfig
from socnav_env.config.rewards import RewardConfig
from socnav_env.config.robot import RobotConfig
from socnav_env.config.scene import (
    AT_LAPTOP,
    AT_PLANT,
    L_SHAPE,
    MAX_WALLS,
    OBJECTS_OF_RELATION,
    PEOPLE_OF_RELATION,
    RECTANGLE,
    RELATIONS,
    ROOM_KINDS,
    SQUARE,
    TALKING,
    WALKING_TOGETHER,
    ConversationConfig,
    PopulationConfig,
    RoomConfig,
)
from socnav_env.config.sensors import SensorConfig

__all__ = [
    "AT_LAPTOP",
    "AT_PLANT",
    "L_SHAPE",
    "MAX_HASTE",
    "MAX_WALLS",
    "OBJECTS_OF_RELATION",
    "PEOPLE_OF_RELATION",
    "RECTANGLE",
    "RELATIONS",
    "ROOM_KINDS",
    "SQUARE",
    "TALKING",
    "WALKING_TOGETHER",
    "ConfigError",
    "ConversationConfig",
    "EnvConfig",
    "GroupConfig",
    "OrcaConfig",
    "PeopleConfig",
    "PopulationConfig",
    "RewardConfig",
    "RobotConfig",
    "RoomConfig",
    "SensorConfig",
]
