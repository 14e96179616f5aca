"""A scene's last three seconds as a graph, as the published network reads it.

May import `base` and `scenes`.
"""
