"""`python -m socnav_env`: look at the environment."""

import sys

from socnav_env.commands.main import main

if __name__ == "__main__":
    sys.exit(main())
