"""The graph networks, one file each. Only the networks themselves and their batching import DGL."""

import os

os.environ.setdefault("DGLBACKEND", "pytorch")  # else DGL asks on the terminal and writes into the home folder
