"""Recorded scenes and people's scores of them, and the file formats that they come in.

May import `base`.
"""
