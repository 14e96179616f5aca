"""Measurements of speed, each figure with its method: `python -m benchmarks.NAME --help`.

May import every package of the project; nothing imports it.
"""
