"""The commands of `python -m socnav_env`. May import everything else in this package."""
