"""Measurements of speed, each figure with its method: `python -m benchmarks.NAME --help`."""
