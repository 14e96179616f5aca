"""Many worlds at once, in this process or in several.

May import `env` and what that is built of.
"""
