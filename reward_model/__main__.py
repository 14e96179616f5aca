"""`python -m reward_model`: score recorded scenes and look after the weights."""

import sys

from reward_model.commands.main import main

if __name__ == "__main__":
    sys.exit(main())
