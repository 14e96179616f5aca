"""The graph networks, a file each, the forms that they are trained in, their checkpoints, and the registry of them all.

May import `base`, `scenes` and `graph`. Only this folder imports DGL, and it does so when a network on DGL is built.
"""

import os

os.environ.setdefault("DGLBACKEND", "pytorch")  # else DGL asks on the terminal and writes into the home folder
