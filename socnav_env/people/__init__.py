"""People: walking models, interactions and targets.

May import `config`, `layout` and `geometry`.
"""
