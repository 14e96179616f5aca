"""Training a network: one run that can be resumed, and many runs side by side.

May import `data`, `analysis` and what they are built of.
"""
