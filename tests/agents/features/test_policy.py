"""What is worked out once is what would be worked out each time."""

from __future__ import annotations

import numpy as np
import torch
from gymnasium import spaces

from agents.features.extractor import describe, described
from agents.features.policy import EntityPolicy, EntityRolloutBuffer
from agents.policy_files import build_policy
from tests.agents.disc import CAPACITIES, entities_space

ACTIONS = spaces.Box(-1.0, 1.0, (2,), np.float32)
ARCHITECTURE = {"entity_width": 8, "net_arch": [8], "log_std_init": -0.5}


def sampled(size: int) -> dict[str, np.ndarray]:
    space = entities_space()
    space.seed(0)
    samples = [space.sample() for _ in range(size)]
    batch = {key: np.stack([sample[key] for sample in samples]) for key in space}
    return {key: (values > 0.5).astype(np.float32) if "mask" in key else values for key, values in batch.items()}


def test_actor_and_critic_read_what_each_would_read_alone() -> None:
    policy = build_policy(entities_space(), ACTIONS, ARCHITECTURE)
    assert isinstance(policy, EntityPolicy)
    observations = {key: torch.from_numpy(values) for key, values in sampled(5).items()}
    for given in (observations, describe(observations, CAPACITIES)):
        actor, critic = policy.extract_features(given)
        torch.testing.assert_close(actor, policy.pi_features_extractor(observations))
        torch.testing.assert_close(critic, policy.vf_features_extractor(observations))
    assert not torch.allclose(actor, critic)


def test_rows_of_absent_entities_are_left_away() -> None:
    observations = {key: torch.from_numpy(values) for key, values in sampled(4).items()}
    given = described(observations, CAPACITIES)
    counts = [observations[f"{kind}_mask"].sum(dim=1).int().tolist() for kind in CAPACITIES]
    assert [len(rows) for rows in given.rows.values()] == [sum(each) for each in counts]
    assert given.counts.tolist() == [count for each in counts for count in each]
    assert given.samples.tolist() == [sample for each in counts for sample in range(4) for _ in range(each[sample])]


def test_a_buffers_samples_are_described_once(monkeypatch) -> None:
    calls = []
    monkeypatch.setattr("agents.features.policy.describe", lambda *given: calls.append(1) or describe(*given))
    buffer = EntityRolloutBuffer(3, entities_space(), ACTIONS, "cpu", n_envs=2)
    for rollout in range(2):
        buffer.reset()
        batches = sampled(6)
        for step in range(3):
            seen = {key: values[2 * step : 2 * step + 2] for key, values in batches.items()}
            number = np.array([[step, env] for env in range(2)], dtype=np.float32)
            buffer.add(seen, number, np.zeros(2), np.zeros(2), torch.zeros(2), torch.zeros(2))
        expected = describe({key: torch.from_numpy(values) for key, values in batches.items()}, CAPACITIES)
        for _ in range(2):
            for samples in buffer.get(4):
                places = (2 * samples.actions[:, 0] + samples.actions[:, 1]).long()
                assert samples.observations.keys() == expected.keys()
                for key, values in samples.observations.items():
                    torch.testing.assert_close(values, expected[key][places])
        assert len(calls) == rollout + 1
