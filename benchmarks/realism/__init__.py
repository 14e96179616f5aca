"""Comparison of simulated with real pedestrians: `python -m benchmarks.realism`.

May import `socnav_env` and `reward_model`.
"""
