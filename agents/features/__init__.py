"""Features of the `entities` observation that do not depend on the order of people and objects, and policies on them.

May import nothing else of this package.
"""
