"""Comparison of simulated with real pedestrians: `python -m benchmarks.realism`."""
