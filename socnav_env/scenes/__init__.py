"""Initial layouts drawn at random: rooms, and the people and objects in them.

May import `config`, `layout` and `geometry`.
"""
