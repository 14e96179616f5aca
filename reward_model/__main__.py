"""`python -m reward_model`: score recorded scenes; train and evaluate networks."""

import sys

from reward_model.commands.main import main

if __name__ == "__main__":
    sys.exit(main())
