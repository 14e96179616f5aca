"""Many trainings that answer one question: random search, and experiments over networks and seeds.

May import `training` and what it is built of.
"""
