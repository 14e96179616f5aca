"""Training a network: one run that can be resumed, and many runs side by side.

May import `data`, `analysis` and the folders that they import.
"""
