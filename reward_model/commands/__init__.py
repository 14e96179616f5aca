"""The commands of `python -m reward_model`. May import everything else in this package."""
