"""Behaviour of reward models on odd scenes: `python -m benchmarks.robustness --help`.

May import every package of the project; nothing imports it.
"""
