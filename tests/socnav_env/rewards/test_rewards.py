import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from reward_model.scenes.scene import Scores
from socnav_env import rewards
from socnav_env.config import ConfigError, RewardConfig
from socnav_env.rewards import (
    REWARDS,
    CrowdNavReward,
    LearnedReward,
    MixedReward,
    Moment,
    RawScoreReward,
    Reward,
    make_reward,
    weighted_terms,
)
from socnav_env.trajectories.outcomes import Outcome
from tests.socnav_env.puppets import PuppetWorld, make_layout

SCORER = SimpleNamespace(name="fixed", score_windows=lambda windows: np.full((len(windows), 2), 0.5, np.float32))


@pytest.fixture(autouse=True)
def _fixed_scorer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rewards, "shared_scorer", lambda weights: SCORER)


def moment(outcome: Outcome | None = None, scores: Scores | None = None, clearance: float = 9.0) -> Moment:
    world = PuppetWorld(make_layout(people_poses=np.array([[clearance + 0.5, 0.0, 0.0], [9.5, 9.5, 0.0]])))
    return Moment(world, duration=0.2, progress=0.05, outcome=outcome, scores=scores)


def test_learned_pays_what_is_missing_to_a_perfect_score() -> None:
    reward = make_reward("learned", RewardConfig(social=2.0))
    terms = weighted_terms(reward, moment(scores=Scores(0.9, 0.75)))
    assert terms == {"social": pytest.approx(2 * -0.25 * 0.2), "arrival": 0.0, "contact": 0.0}


@pytest.mark.parametrize("duration", [0.1, 0.2])
def test_learned_pays_by_the_second_and_takes_scores_within_0_and_1(duration: float) -> None:
    reward = make_reward("learned", RewardConfig())
    for q2, social in ((1.2, 0.0), (0.5, -0.5 * duration), (-0.5, -duration)):
        assert reward.terms(replace(moment(scores=Scores(1.1, q2)), duration=duration))["social"] == social


@pytest.mark.parametrize(
    ("outcome", "arrival", "contact"),
    [
        (Outcome.ARRIVED, 10.0, 0.0),
        (Outcome.COLLISION_PERSON, 0.0, -10.0),
        (Outcome.COLLISION_OBJECT, 0.0, -10.0),
        (Outcome.COLLISION_WALL, 0.0, -10.0),
        (Outcome.TIMEOUT, 0.0, 0.0),
    ],
)
@pytest.mark.parametrize("name", ["learned", "sparse"])
def test_terminal_terms_are_paid_once_at_the_end(name: str, outcome: Outcome, arrival: float, contact: float) -> None:
    weights = {"arrival": 10.0, "contact": -10.0, "sparse_arrival": 10.0, "sparse_contact": -10.0}
    reward = make_reward(name, RewardConfig(**weights))
    terms = weighted_terms(reward, moment(outcome, Scores(0.5, 0.5)))
    assert (terms["arrival"], terms["contact"]) == (arrival, contact)


def test_q2_is_the_raw_score() -> None:
    reward = make_reward("q2", RewardConfig())
    assert weighted_terms(reward, moment(Outcome.COLLISION_WALL, Scores(0.1, 1.25))) == {"q2": 1.25}


@pytest.mark.parametrize(
    ("name", "pessimism", "paid"),
    [("q1", 0.0, 0.9), ("q1", 2.0, 0.7), ("q2", 1.0, 0.55), ("q2", 4.0, 0.0), ("learned", 1.0, -0.09)],
)
def test_pessimism_pays_less_where_members_disagree(name: str, pessimism: float, paid: float) -> None:
    reward = make_reward(name, RewardConfig(pessimism=pessimism))
    scores = Scores(0.9, 0.75, q1_std=0.1, q2_std=0.2)
    assert sum(weighted_terms(reward, moment(scores=scores)).values()) == pytest.approx(paid)


def test_pessimism_is_no_optimism() -> None:
    with pytest.raises(ConfigError, match=r"reward.pessimism must be a number of at least 0, got -1"):
        RewardConfig(pessimism=-1.0)


def test_crowdnav_pays_for_coming_close_by_the_metre_and_second() -> None:
    reward = make_reward("crowdnav", RewardConfig())
    terms = weighted_terms(reward, moment(clearance=0.1))
    assert terms == {"discomfort": pytest.approx(0.5 * (0.1 - 0.2) * 0.2), "arrival": 0.0, "contact": 0.0}
    assert weighted_terms(reward, moment(clearance=0.2000001))["discomfort"] == 0.0


@pytest.mark.parametrize(
    ("outcome", "total"), [(Outcome.ARRIVED, 1.0), (Outcome.COLLISION_PERSON, -0.25), (Outcome.TIMEOUT, -0.01)]
)
def test_crowdnav_counts_discomfort_only_where_nothing_better_is_known(outcome: Outcome, total: float) -> None:
    reward = make_reward("crowdnav", RewardConfig())
    assert sum(weighted_terms(reward, moment(outcome, clearance=0.1)).values()) == pytest.approx(total)


def test_q1_knows_only_of_disturbance() -> None:
    reward = make_reward("q1", RewardConfig(score=2.0))
    assert weighted_terms(reward, moment(Outcome.ARRIVED, Scores(0.25, 1.0))) == {"q1": 0.5}


@pytest.mark.parametrize(
    ("outcome", "clearance", "expected"),
    [
        (None, 9.0, {"progress": 2 * 0.05}),
        (None, 0.2500001, {"progress": 2 * 0.05}),
        (None, 0.15, {"discomfort": 10 * (0.15 - 0.25) * 0.2}),
        (Outcome.TIMEOUT, 0.15, {"discomfort": 10 * (0.15 - 0.25) * 0.2}),
        (Outcome.TIMEOUT, 9.0, {"progress": 2 * 0.05}),
        (Outcome.ARRIVED, 0.15, {"arrival": 10.0}),
        (Outcome.COLLISION_PERSON, -0.01, {"contact": -20.0}),
    ],
)
def test_dsrnn_pays_progress_where_nobody_is_near(outcome: Outcome | None, clearance: float, expected: dict) -> None:
    terms = weighted_terms(make_reward("dsrnn", RewardConfig()), moment(outcome, clearance=clearance))
    zeros = {"progress": 0.0, "discomfort": 0.0, "arrival": 0.0, "contact": 0.0}
    assert terms == pytest.approx({**zeros, **expected})


def test_dsrnn_charges_what_its_authors_do_in_their_steps() -> None:
    step = replace(moment(clearance=0.05), duration=0.25)
    assert weighted_terms(make_reward("dsrnn", RewardConfig()), step)["discomfort"] == pytest.approx(2.5 * -0.2)


@pytest.mark.parametrize(
    "mix",
    [
        "learned+0.5*crowdnav",
        " 1*learned + 0.5*crowdnav ",
        {"learned": 1.0, "crowdnav": 0.5},
        "mix",
    ],
)
def test_a_mix_adds_up_its_parts_under_their_names(mix: str | dict[str, float]) -> None:
    config = RewardConfig(mix=(("learned", 1.0), ("crowdnav", 0.5)))
    reward = make_reward(mix, config)
    assert reward.scorer is SCORER
    assert weighted_terms(reward, moment(Outcome.ARRIVED, Scores(0.5, 0.75))) == {
        "learned.social": pytest.approx(-0.25 * 0.2),
        "learned.arrival": 50.0,
        "learned.contact": 0.0,
        "crowdnav.discomfort": 0.0,
        "crowdnav.arrival": 0.5,
        "crowdnav.contact": 0.0,
    }


def test_a_mix_of_objects_needs_one_scorer() -> None:
    ours, theirs = SCORER, SimpleNamespace(name="theirs", score_windows=SCORER.score_windows)
    parts = {"a": (1.0, RawScoreReward({"q2": 1.0}, ours)), "b": (1.0, RawScoreReward({"q1": 1.0}, theirs))}
    with pytest.raises(ValueError, match="the rewards of a mix must share one scorer, got fixed, theirs"):
        MixedReward(parts)
    assert MixedReward({"a": parts["a"], "c": (2.0, make_reward("sparse", RewardConfig()))}).scorer is ours
    assert MixedReward({"c": (2.0, make_reward("sparse", RewardConfig()))}).scorer is None


@pytest.mark.parametrize(
    ("mix", "message"),
    [
        ({}, "a mix must have at least one reward, got none"),
        ({"fame": 1.0}, "a mix of rewards must be of learned, q1, q2, crowdnav, dsrnn, sparse, got 'fame'"),
        ({"mix": 1.0}, "a mix of rewards must be of learned, q1, q2, crowdnav, dsrnn, sparse, got 'mix'"),
        ({"learned": np.nan}, "the share of learned in a mix of rewards must be a number, got nan"),
        ("inf*learned", "the share of learned in a mix of rewards must be a number, got inf"),
        ("learned+", "got 'learned\\+'"),
        ("two*learned", "got 'two\\*learned'"),
        ("q1+q1", "got 'q1\\+q1'"),
    ],
)
def test_a_mix_that_is_none_is_refused(mix: str | dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make_reward(mix, RewardConfig())


def test_crowdnav_is_at_ease_in_an_empty_room() -> None:
    world = PuppetWorld(make_layout(people_poses=np.zeros((0, 3)), interaction_pairs=np.zeros((0, 2), dtype=np.int64)))
    reward = make_reward("crowdnav", RewardConfig())
    assert reward.terms(Moment(world, 0.2, 0.0, None, None))["discomfort"] == 0.0


@pytest.mark.parametrize("name", REWARDS)
@pytest.mark.parametrize("outcome", [None, *Outcome])
def test_every_reward_names_the_same_weighted_terms_whatever_happens(name: str, outcome: Outcome | None) -> None:
    reward = make_reward(name, RewardConfig())
    assert isinstance(reward, Reward)
    terms = reward.terms(moment(outcome, Scores(0.5, 0.5), clearance=0.1))
    assert set(terms) == set(reward.weights)
    assert all(np.isfinite(value) for value in terms.values())


def test_an_object_is_taken_as_it_is() -> None:
    reward = LearnedReward({"social": 1.0, "arrival": 1.0, "contact": 1.0}, SCORER)
    assert make_reward(reward, RewardConfig()) is reward


@pytest.mark.parametrize("stranger", [7, None, CrowdNavReward])
def test_what_is_not_a_reward_is_refused(stranger: object) -> None:
    with pytest.raises(ValueError, match=r"reward must be one of learned, q1, .*, mix or an object with"):
        make_reward(stranger, RewardConfig())


def test_an_unknown_name_is_answered_with_the_valid_ones() -> None:
    with pytest.raises(
        ValueError, match=r"reward must be one of learned, q1, .* mix such as learned\+0.5\*crowdnav, got 'learnt'"
    ):
        make_reward("learnt", RewardConfig())


def test_a_term_without_a_weight_is_named() -> None:
    reward = CrowdNavReward({"arrival": 1.0, "discomfort": 1.0}, 0.2)
    with pytest.raises(ValueError, match="reward term 'contact' needs a weight, weights are arrival, discomfort"):
        weighted_terms(reward, moment())


def test_handcrafted_rewards_load_no_network() -> None:
    program = (
        "import sys; from socnav_env.rewards import make_reward; from socnav_env.config import RewardConfig; "
        "make_reward('crowdnav', RewardConfig()), make_reward('sparse', RewardConfig()); "
        "sys.exit('torch' in sys.modules or 'dgl' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
