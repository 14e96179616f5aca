"""Distances, frames of reference, rays and shortest paths in the plane, compiled.

May import `layout` and nothing else of this package.
"""
