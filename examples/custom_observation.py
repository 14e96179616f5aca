"""An observation of one's own: the goal and the nearest person. Run `python examples/custom_observation.py`."""

import gymnasium as gym
import numpy as np

import socnav_env  # noqa: F401 registers SocNav2-v0
from socnav_env.config import EnvConfig
from socnav_env.geometry.frames import points_in_frame
from socnav_env.simulation.world import World


class GoalAndNearest:
    """Any object with these two is an observation; it asks the world and keeps nothing."""

    def space(self) -> gym.spaces.Box:
        """Where all observations lie."""
        return gym.spaces.Box(-20.0, 20.0, (4,), np.float32)

    def observe(self, world: World, time_left: float) -> np.ndarray:
        """Goal and nearest person in the robot's frame [m]; the goal twice in an empty room."""
        nearest = world.people_poses[np.argsort(world.clearance_to_people())[:1], :2]
        points = np.vstack([world.layout.goal, nearest if len(nearest) else world.layout.goal])
        return points_in_frame(world.robot_pose, points).ravel().astype(np.float32)


env = gym.make("SocNav2-v0", reward="dsrnn", observation=GoalAndNearest(), config=EnvConfig(time_limit=20.0))
seen, _ = env.reset(seed=1)
print("goal {:.2f}, {:.2f} and nearest person {:.2f}, {:.2f}".format(*seen))
