"""What every package of the project builds on: numba, files, arrays, angles, progress bars, commands.

Imports nothing of ours; everybody may import it.
"""
