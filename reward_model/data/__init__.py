"""Labelled scenes: files found, read, augmented, split into parts and turned into windows to learn from.

May import what scores (`scorer`) and what that is built of.
"""
