"""The world of one episode while it moves: physics, the robot's motors, and snapshots for the reward model.

May import `people` and what that is built of. Only `physics` imports pymunk.
"""
