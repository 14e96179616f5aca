"""Train a PPO agent in SocNav2-v0, evaluate it beside the baselines and save everything: see --help."""

from __future__ import annotations

import sys

from agents.training_command import main

if __name__ == "__main__":
    sys.exit(main())
