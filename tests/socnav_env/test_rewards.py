import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from reward_model.scenario import Scores
from socnav_env import rewards
from socnav_env.config import RewardConfig
from socnav_env.outcomes import Outcome
from socnav_env.rewards import REWARDS, CrowdNavReward, LearnedReward, Moment, Reward, make_reward, weighted_terms
from tests.socnav_env.puppets import PuppetWorld, make_layout

SCORER = SimpleNamespace(name="fixed", score_windows=lambda windows: np.full((len(windows), 2), 0.5, np.float32))


@pytest.fixture(autouse=True)
def _fixed_scorer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rewards, "shared_scorer", lambda weights: SCORER)


def moment(outcome: Outcome | None = None, scores: Scores | None = None, clearance: float = 9.0) -> Moment:
    world = PuppetWorld(make_layout(people_poses=np.array([[clearance + 0.5, 0.0, 0.0], [9.5, 9.5, 0.0]])))
    return Moment(world, duration=0.2, progress=0.05, outcome=outcome, scores=scores)


def test_learned_pays_what_is_missing_to_a_perfect_score() -> None:
    reward = make_reward("learned", RewardConfig(social=2.0, arrival=10.0, contact=-10.0))
    assert weighted_terms(reward, moment(scores=Scores(0.9, 0.75))) == {"social": -0.5, "arrival": 0.0, "contact": 0.0}


def test_learned_never_pays_for_a_score_above_perfect() -> None:
    reward = make_reward("learned", RewardConfig())
    assert reward.terms(moment(scores=Scores(1.1, 1.2)))["social"] == 0.0


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
    reward = make_reward(name, RewardConfig(arrival=10.0, contact=-10.0))
    terms = weighted_terms(reward, moment(outcome, Scores(0.5, 0.5)))
    assert (terms["arrival"], terms["contact"]) == (arrival, contact)


def test_q2_is_the_raw_score() -> None:
    reward = make_reward("q2", RewardConfig())
    assert weighted_terms(reward, moment(Outcome.COLLISION_WALL, Scores(0.1, 1.25))) == {"q2": 1.25}


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
    with pytest.raises(ValueError, match=r"reward must be one of learned, q2, crowdnav, sparse or an object with"):
        make_reward(stranger, RewardConfig())


def test_an_unknown_name_is_answered_with_the_valid_ones() -> None:
    with pytest.raises(ValueError, match=r"reward must be one of learned, q2, crowdnav, sparse .* got 'learnt'"):
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
