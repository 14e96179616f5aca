"""DQN on a grid of actions. It learns next to nothing in so few steps. Run `python examples/dqn.py [STEPS]`."""

import sys

import gymnasium as gym
from stable_baselines3 import DQN

import socnav_env  # noqa: F401 registers SocNav2-v0
from socnav_env.wrappers import DiscreteActions

env = DiscreteActions(gym.make("SocNav2-v0", reward="dsrnn", observation="flat"), speeds=(0.0, 0.5, 1.0))
model = DQN("MlpPolicy", env, learning_starts=100, buffer_size=10_000, seed=0)
model.learn(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
seen, _ = env.reset(seed=1)
print("forward {:.1f}, turn {:.1f}".format(*env.table[model.predict(seen, deterministic=True)[0]]))
