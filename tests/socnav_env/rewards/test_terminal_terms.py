"""Arriving is better than standing to the end, and standing is better than touching something, at every discount.

The bounds are exact for the default weights and time limit: scores are the worst or best that there are.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from reward_model.scenes.scene import Scores
from socnav_env import rewards
from socnav_env.config import EnvConfig
from socnav_env.rewards import Moment, make_reward, weighted_terms
from socnav_env.trajectories.outcomes import Outcome
from tests.socnav_env.puppets import PuppetWorld

SCORER = SimpleNamespace(name="fixed", score_windows=None)
CONFIG = EnvConfig()
STEPS = 300  # 60 s

# discount; the most that standing can cost: to the end, and for ever; the longest drive [steps] at Q2 = 0 that is still
# better than to stand at Q2 = 1; the longest drive at Q2 = 1 to a collision that is still worse than to stand at Q2 = 0
BOUNDS = [
    (0.9, 2.0, 2.0, 31, 34),
    (0.95, 4.0, 4.0, 51, 56),
    (0.97, 6.6659, 6.6667, 71, 78),
    (0.98, 9.9767, 10.0, 89, 97),
    (0.99, 19.0192, 20.0, 125, 130),
    (0.995, 31.1083, 40.0, 162, 162),
    (0.997, 39.5987, 66.6667, 186, 190),
    (1.0, 60.0, None, 249, 300),
]
DISCOUNTS = [row[0] for row in BOUNDS]


@pytest.fixture(autouse=True)
def _fixed_scorer(monkeypatch):
    monkeypatch.setattr(rewards, "shared_scorer", lambda weights: SCORER)


def step(q2, outcome=None):
    """The reward of one step."""
    moment = Moment(PuppetWorld(), CONFIG.control_period, 0.0, outcome, Scores(0.5, q2))
    return sum(weighted_terms(make_reward("learned", CONFIG.reward), moment).values())


def discounted(discount, *parts):
    """The return of a number of steps of each reward, one after the other: pairs (steps, reward)."""
    values = np.concatenate([np.full(steps, reward) for steps, reward in parts])
    return float(values @ discount ** np.arange(len(values)))


def drive(discount, steps, q2, outcome):
    return discounted(discount, (steps - 1, step(q2)), (1, step(q2, outcome)))


@pytest.mark.parametrize(("discount", "to_the_end", "for_ever", "_", "__"), BOUNDS)
def test_touching_something_costs_more_than_standing_ever_can(discount, to_the_end, for_ever, _, __):
    worst = step(0.0)
    assert discounted(discount, (STEPS, worst)) == pytest.approx(-to_the_end, abs=1e-4)
    touching = max(step(q2, Outcome.COLLISION_PERSON) for q2 in (-1.0, 0.0, 0.5, 1.0, 17.7))
    assert touching == -70.0
    assert touching < -to_the_end
    if for_ever is not None:
        assert worst / (1 - discount) == pytest.approx(-for_ever, abs=1e-4)
        assert touching < -for_ever


@pytest.mark.parametrize("discount", DISCOUNTS)
@pytest.mark.parametrize("left", [1, 2, 50, 299])
def test_touching_something_is_never_better_however_little_time_is_left(discount, left):
    assert step(1.0, Outcome.COLLISION_WALL) < discounted(discount, (left, step(0.0)))


@pytest.mark.parametrize(("discount", "_", "__", "longest", "___"), BOUNDS)
def test_arriving_is_better_than_standing_at_its_best_after_long_drives_at_their_worst(discount, _, __, longest, ___):
    returns = [drive(discount, steps, 0.0, Outcome.ARRIVED) for steps in range(1, STEPS + 1)]
    assert [steps for steps, value in enumerate(returns, 1) if value > 0.0] == list(range(1, longest + 1))


@pytest.mark.parametrize(("discount", "_", "__", "___", "longest"), BOUNDS)
def test_standing_at_its_worst_is_better_than_long_drives_at_their_best_to_a_collision(discount, _, __, ___, longest):
    standing = discounted(discount, (STEPS, step(0.0)))
    returns = [drive(discount, steps, 1.0, Outcome.COLLISION_OBJECT) for steps in range(1, STEPS + 1)]
    assert [steps for steps, value in enumerate(returns, 1) if value < standing] == list(range(1, longest + 1))


@pytest.mark.parametrize("discount", DISCOUNTS)
@pytest.mark.parametrize("q2", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("steps", [1, 100, 299])
def test_arriving_is_better_than_standing_where_driving_is_no_worse_than_standing(discount, q2, steps):
    assert drive(discount, steps, q2, Outcome.ARRIVED) > discounted(discount, (STEPS, step(q2)))


def test_the_bound_holds_for_longer_episodes_and_any_control_period():
    reward = CONFIG.reward
    assert reward.social * CONFIG.time_limit == pytest.approx(60.0)
    assert -reward.contact / reward.social == pytest.approx(70.0)  # s without a discount
    assert 1 + reward.social * CONFIG.control_period / reward.contact == pytest.approx(0.99714, abs=1e-5)
