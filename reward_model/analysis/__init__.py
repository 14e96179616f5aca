"""What a network has learned: its errors, its behaviours and heatmaps, and how far people agree.

May import `base`, `scenes` and `graph`; the networks that it asks are handed to it.
"""
