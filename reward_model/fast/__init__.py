"""Trained networks in compiled code, from windows of frames to scores; described in README.md.

May import `base`, `scenes`, `graph` and `networks`. The only place with compiled kernels of networks.
"""
