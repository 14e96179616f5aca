"""How like real pedestrians the simulated ones walk: `python -m benchmarks.realism`."""
