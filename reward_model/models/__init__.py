"""The graph networks, one file each. Only the networks themselves import DGL."""
