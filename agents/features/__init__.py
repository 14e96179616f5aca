"""What a policy reads of the `entities` observation: features that do not depend on the order of people and objects.

May import nothing else of this package.
"""
