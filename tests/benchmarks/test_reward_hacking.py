import json

import numpy as np
import pytest

from benchmarks.exploits import EXPLOITS, REFERENCES
from benchmarks.exploits.playing import DISCOUNTS, Played, play
from benchmarks.exploits.policy import Kind
from benchmarks.exploits.report import Hole, Row, Table, holes_of, row_of
from benchmarks.reward_hacking import main
from socnav_env.config import EnvConfig, PopulationConfig
from socnav_env.env import SocNavEnv
from socnav_env.trajectories.outcomes import Outcome

NOBODY = PopulationConfig(still=(0, 0), wandering=(0, 0), tables=(0, 0), plants=(0, 0), interactions=(0, 0))


def played(outcome, *rewards):
    return Played(outcome, np.array(rewards), {"w": np.array([[0.25, 0.5], [0.75, 1.5]], np.float32)})


def row(policy, *values):
    by_discount = {discount: [value, value - 1.0] for discount, value in zip(DISCOUNTS, values, strict=True)}
    endless = {discount: pair for discount, pair in by_discount.items() if discount < 1}
    returns = {"ended": by_discount, "bootstrapped": endless}
    return Row(policy, EXPLOITS[policy][0].value, 2, {outcome.value: 0.0 for outcome in Outcome}, {}, returns)


@pytest.mark.parametrize("name", EXPLOITS)
def test_every_policy_drives_within_the_robots_limits(name):
    env = SocNavEnv("sparse", config=EnvConfig(time_limit=6.0))
    env.begin(3)
    policy, robot = EXPLOITS[name][1](), env.config.robot
    ended = False
    while not ended:
        forward, left, turn = policy(env.world)
        assert -robot.max_backward_speed <= forward <= robot.max_forward_speed
        assert left == 0.0 and abs(turn) <= robot.max_turn_rate
        env.advance(np.array([forward, left, turn]))
        result = env.conclude(None)
        ended = result.terminated or result.truncated


@pytest.mark.parametrize(
    ("name", "outcome"),
    [
        ("stand", Outcome.TIMEOUT),
        ("spin", Outcome.TIMEOUT),
        ("jitter", Outcome.TIMEOUT),
        ("sway", Outcome.TIMEOUT),
        ("hug a wall", Outcome.TIMEOUT),
        ("hover at the goal", Outcome.TIMEOUT),
        ("shuttle at the goal", Outcome.TIMEOUT),
        ("crash into a wall", Outcome.COLLISION_WALL),
        ("arrive backwards", Outcome.ARRIVED),
        ("straight", Outcome.ARRIVED),
        ("planner", Outcome.ARRIVED),
    ],
)
def test_what_becomes_of_a_policy_in_an_empty_room(name, outcome):
    env = SocNavEnv("sparse", config=EnvConfig(population=NOBODY))
    assert {play(env, EXPLOITS[name][1], seed, {}).outcome for seed in range(3)} == {outcome}


@pytest.mark.parametrize(("name", "outcome"), [("object", "collision_object"), ("person", "collision_person")])
def test_who_crashes_does_so_with_what_it_says(name, outcome):
    env = SocNavEnv("sparse")
    outcomes = [play(env, EXPLOITS[f"crash into a{'n' * (name == 'object')} {name}"][1], seed, {}) for seed in range(6)]
    assert sum(each.outcome.value == outcome for each in outcomes) >= 3


def test_the_planner_arrives_among_people():
    env = SocNavEnv("sparse")
    outcomes = [play(env, EXPLOITS["planner"][1], seed, {}).outcome for seed in range(6)]
    assert outcomes.count(Outcome.ARRIVED) >= 5


def test_returns_are_discounted_by_the_step():
    episode = played(Outcome.TIMEOUT, -1.0, -2.0)
    assert episode.discounted(0.5) == -2.0
    assert episode.discounted(1.0) == -3.0
    assert episode.bootstrapped(0.5, last_steps=1) == -2.0 + 0.25 * -4.0
    assert episode.bootstrapped(0.5, last_steps=2) == -2.0 + 0.25 * -3.0
    assert played(Outcome.ARRIVED, -1.0, -2.0).bootstrapped(0.5, last_steps=1) == -2.0


def test_a_row_sums_up_episodes():
    summed = row_of("stand", [played(Outcome.TIMEOUT, -1.0, 0.0), played(Outcome.COLLISION_WALL, -3.0, 0.0)], 0.2)
    assert summed.outcomes["timeout"] == summed.crashed == 0.5
    assert summed.scores == {"w": [0.5, 1.0, 0.75, 1.5]}
    assert summed.returns["ended"][1.0] == [-1.0, -3.0]
    assert list(summed.returns["bootstrapped"]) == [0.9, 0.95, 0.97, 0.98, 0.99, 0.995, 0.999]


def test_holes_are_found_where_a_return_is_above_the_one_it_must_not_beat():
    low, high = [-2.0] * len(DISCOUNTS), [1.0] * len(DISCOUNTS)
    stands = row("stand", *low[:-1], -5.0)
    assert holes_of([stands, row("crash into a wall", *low[:-1], -4.0), row("planner", *high)]) == [
        Hole("crash into a wall", "stand", "ended", 1.0, 1.0, 1.0)
    ]
    assert holes_of([stands, row("spin", 1.5, *low[1:]), row("straight", *high), row("planner", *high)]) == [
        Hole("spin", "planner", "ended", 0.9, 0.5, 1.0),
        Hole("spin", "planner", "bootstrapped", 0.9, 0.5, 1.0),
    ]


def test_exploits_are_of_every_kind():
    kinds = [kind for name, (kind, _) in EXPLOITS.items() if name not in REFERENCES]
    assert set(kinds) == set(Kind) and len(kinds) >= 10


def test_a_table_in_markdown():
    table = Table("Title", ["policy", "0.9"], [["stand", "-1.0"]])
    assert table.markdown() == "**Title**\n\n| policy | 0.9 |\n| --- | ---: |\n| stand | -1.0 |\n"


def test_the_command_prints_tables_and_writes_json(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("SOCNAV_CACHE", str(tmp_path))
    (tmp_path / "short.json").write_text('{"time_limit": 0.4}')
    options = ["--episodes", "1", "--only", "spin", "--env-config", str(tmp_path / "short.json")]
    assert main([*options, "--output-format", "markdown", "--output", str(tmp_path / "found.json")]) == 0
    assert "\n| spin | 0.00 | 0.00 | 1.00 |" in capsys.readouterr().out
    found = json.loads((tmp_path / "found.json").read_text())
    assert [each["policy"] for each in found["policies"]] == ["stand", "spin", "planner"]
    assert found["discounts"] == [0.9, 0.95, 0.97, 0.98, 0.99, 0.995, 0.999, 1.0]
    assert list(found["policies"][0]["scores"]) == ["default"]
