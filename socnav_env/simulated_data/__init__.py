"""Training scenes in bulk: a robot driven well and badly through simulated rooms.

May import `simulation`, `scenes` and what they are built of; no Gymnasium.
"""
