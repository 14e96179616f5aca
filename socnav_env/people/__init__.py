"""How people walk, with whom they interact, and where they go next.

May import `config`, `layout` and `geometry`.
"""
