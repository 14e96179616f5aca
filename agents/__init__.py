"""Agents for SocNav2-v0: PPO, baselines, and their evaluation."""

from agents.errors import AgentError
from agents.policy import Policy, agent_names, load_agent

__all__ = ["AgentError", "Policy", "agent_names", "load_agent"]
