"""Labelled scenes: finding, reading, augmenting and splitting them, and converting them to training windows.

May import `scorer` and the folders that it imports.
"""
