"""Trained networks in compiled code: windows of frames in, scores out. README.md says how it works.

May import `base`, `scenes`, `graph` and `networks`. The only place with compiled kernels of networks.
"""
