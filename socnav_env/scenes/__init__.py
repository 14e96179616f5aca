"""What an episode starts from, drawn at random: rooms, and who and what stands where.

May import `config`, `layout` and `geometry`.
"""
