import numpy as np
import pytest

from agents.storage import AgentError
from agents.visited import MOST_WINDOWS, AgentEpisode


def test_windows_are_those_of_an_agents_episodes():
    episode = AgentEpisode("straight")
    one, same = (episode(np.random.default_rng(3)) for _ in range(2))
    other = episode(np.random.default_rng(4))
    assert 1 <= len(one) <= MOST_WINDOWS
    assert all(len(window) == 3 for window in one)
    for first, second in zip(one, same, strict=True):
        np.testing.assert_array_equal(first[0].words, second[0].words)
    assert len(one[0][0].words) != len(other[0][0].words) or (one[0][0].words != other[0][0].words).any()
    assert episode.name == "agent straight"


def test_an_unknown_agent_is_named():
    with pytest.raises(AgentError, match="no agent 'nobody'"):
        AgentEpisode("nobody")(np.random.default_rng(0))
