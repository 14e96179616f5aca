"""Analysis of networks: errors, behaviours and heatmaps, and the agreement among people.

May import `base`, `scenes` and `graph`; networks are passed in as arguments.
"""
