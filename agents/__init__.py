"""Agents for SocNav2-v0: PPO, baselines, and their evaluation. May import `socnav_env` and `reward_model`."""

from agents.policy import Policy
from agents.policy_files import agent_names, load_agent
from agents.storage import AgentError

__all__ = ["AgentError", "Policy", "agent_names", "load_agent"]
