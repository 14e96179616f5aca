"""The basics of every package of the project: numba, files, arrays, angles, progress bars, commands.

Imports no other folder of the project; all of them may import it.
"""
