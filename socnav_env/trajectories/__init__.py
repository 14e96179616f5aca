"""Episodes as plain arrays, from this simulator or from SocNav2's files, and how they ended.

May import `simulation` and what that is built of.
"""
