"""Episodes as plain arrays, from this simulator or from SocNav2's files, and their outcomes.

May import `simulation` and what that is built of.
"""
