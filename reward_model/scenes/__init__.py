"""Recorded scenes, people's scores of them, and their file formats.

May import `base`.
"""
