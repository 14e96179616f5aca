import dataclasses
import math
import time
from collections import Counter

import numpy as np
import pytest
from scipy.stats import chisquare

from socnav_env.config import (
    AT_LAPTOP,
    AT_PLANT,
    RELATIONS,
    ROOM_KINDS,
    TALKING,
    WALKING_TOGETHER,
    ConfigError,
    EnvConfig,
)
from socnav_env.geometry.distances import box_distances, boxes_of, inside_each, wall_distances
from socnav_env.layout import Layout, ObjectKind
from socnav_env.people.interactions import standing_groups
from socnav_env.scenes.population import sample_layout
from socnav_env.scenes.rooms import is_reachable

NOBODY = {"still": [0, 0], "wandering": [0, 0], "tables": [0, 0], "plants": [0, 0], "interactions": [0, 0]}


def config_with(**population):
    return EnvConfig.from_dict({"population": NOBODY | population})


def pair_of(layout, number):
    """Poses of the two ends of an interaction."""
    poses = np.concatenate([layout.people_poses, layout.object_poses])
    return poses[layout.interaction_pairs[number]]


def looks_past(watcher, other):
    """By how much a pose's heading misses another's place [rad]."""
    return abs(math.remainder(math.atan2(other[1] - watcher[1], other[0] - watcher[0]) - watcher[2], 2 * math.pi))


def assert_nothing_overlaps(layout: Layout, config: EnvConfig) -> None:
    clearance, walls = config.people.clearance, layout.room.walls
    before_table = min(clearance, config.population.watching_distance[0] - math.hypot(0.9, 0.8) / 2)
    boxes = boxes_of(layout.object_poses, layout.object_sizes)
    places = np.vstack([layout.people_poses[:, :2], layout.robot_pose[:2], layout.goal])
    group = np.append(layout.people_group, [-1, -1])
    assert inside_each(np.vstack([places, layout.object_poses[:, :2]]), walls).all()
    for x, y in places:
        assert wall_distances(x, y, walls).min() >= clearance
        assert box_distances(x, y, boxes).min(initial=9.0) >= before_table
    for (x, y, _), size in zip(layout.object_poses, layout.object_sizes, strict=True):
        assert wall_distances(x, y, walls).min() >= math.hypot(*size) / 2
    apart = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
    may_be_close = np.eye(len(places), dtype=bool) | ((group[:, None] == group) & (group >= 0))
    may_be_close[-2, -1] = may_be_close[-1, -2] = True
    assert apart[~may_be_close].min(initial=9.0) >= 2 * clearance
    assert apart[-2, -1] >= config.robot.min_goal_distance


def assert_goal_within_reach(layout: Layout, config: EnvConfig) -> None:
    discs = layout.people_poses[~layout.people_walk]
    discs[:, 2] = config.people.radius
    boxes = boxes_of(layout.object_poses, layout.object_sizes)
    start, goal = layout.robot_pose[:2], layout.goal
    assert is_reachable(start, goal, 0.5, config.robot.radius, layout.room.walls, discs, boxes)


def counts_of(layout: Layout) -> dict[str, int]:
    """How many there are of what the config names, found by who interacts with whom."""
    at, links = Counter(layout.interaction_relations), [set() for _ in range(layout.num_people)]
    for (one, other), relation in zip(layout.interaction_pairs.tolist(), layout.interaction_relations, strict=True):
        links[one].add(relation)
        if other < layout.num_people:
            links[other].add(relation)
    alone = np.array([not each for each in links], dtype=bool)
    groups = Counter(layout.people_group[layout.people_group >= 0].tolist())
    in_circles = [len(group) for group in standing_groups(layout) if len(group) > 2]
    walking = sum(size > 2 for size in groups.values())
    talking_pairs = at[TALKING] - sum(math.comb(size, 2) for size in in_circles)
    couples = sum(size == 2 for size in groups.values())
    return {
        "still": int((alone & ~layout.people_walk).sum()),
        "wandering": int((alone & layout.people_walk).sum()),
        "tables": int((layout.object_kinds == ObjectKind.TABLE).sum()) - at[AT_LAPTOP],
        "plants": int((layout.object_kinds == ObjectKind.PLANT).sum()) - at[AT_PLANT],
        "interactions": talking_pairs + at[AT_LAPTOP] + at[AT_PLANT] + couples,
        "walking_groups": walking,
        "circles": len(in_circles),
    }


@pytest.mark.parametrize("kind", ROOM_KINDS)
def test_a_thousand_default_layouts_are_sound(kind):
    config = EnvConfig.from_dict({"room": {"kinds": [kind]}})
    rng = np.random.default_rng(ROOM_KINDS.index(kind))
    for _ in range(1000):
        layout = sample_layout(config, rng)
        assert_nothing_overlaps(layout, config)
        assert layout.num_people <= config.population.max_people
        assert layout.num_objects <= config.population.max_objects
        assert len(layout.interaction_relations) <= config.population.max_interactions
        assert_goal_within_reach(layout, config)


def test_counts_are_those_asked_for():
    config = config_with(still=[2, 2], wandering=[3, 3], tables=[1, 1], plants=[2, 2])
    layout = sample_layout(config, np.random.default_rng(0))
    assert layout.people_walk.tolist() == [False, False, True, True, True]
    assert layout.people_group.tolist() == [-1] * 5
    assert layout.object_kinds.tolist() == [ObjectKind.TABLE, ObjectKind.LAPTOP, ObjectKind.PLANT, ObjectKind.PLANT]
    assert layout.interaction_pairs.shape == (0, 2)


def test_an_empty_room_has_arrays_of_the_right_shapes():
    layout = sample_layout(config_with(), np.random.default_rng(0))
    assert layout.people_poses.shape == (0, 3)
    assert layout.object_sizes.shape == (0, 2)
    assert (layout.num_people, layout.num_objects, layout.interaction_relations) == (0, 0, ())


def test_a_laptop_stands_on_its_table_and_plants_have_their_size():
    layout = sample_layout(config_with(tables=[1, 1], plants=[1, 1]), np.random.default_rng(0))
    assert layout.object_poses[0].tolist() == layout.object_poses[1].tolist()
    assert layout.object_sizes[0].tolist() == layout.object_sizes[1].tolist()
    assert tuple(layout.object_sizes[0]) in {(0.79, 0.78), (0.9, 0.8)}
    assert layout.object_sizes[2].tolist() == [0.18, 0.35]


def test_two_who_talk_stand_face_to_face():
    config, rng = config_with(interactions=[1, 1], relations=[TALKING]), np.random.default_rng(0)
    distances, angles = [], []
    for _ in range(100):
        layout = sample_layout(config, rng)
        assert layout.interaction_relations == (TALKING,)
        assert not layout.people_walk.any()
        one, other = pair_of(layout, 0)
        distances.append(math.dist(one[:2], other[:2]))
        angles += [looks_past(one, other), looks_past(other, one)]
    assert min(distances) >= 1.5
    assert max(distances) <= 3.0
    assert math.radians(18) < max(angles) <= math.radians(20) + 1e-9


@pytest.mark.parametrize(("relation", "kind"), [(AT_LAPTOP, ObjectKind.LAPTOP), (AT_PLANT, ObjectKind.PLANT)])
def test_a_person_stands_before_an_object_and_faces_it(relation, kind):
    config, rng = config_with(interactions=[2, 2], still=[1, 1], relations=[relation]), np.random.default_rng(0)
    distances = []
    for _ in range(50):
        layout = sample_layout(config, rng)
        assert layout.num_people == 3
        for number in range(2):
            person, thing = pair_of(layout, number)
            assert layout.object_kinds[layout.interaction_pairs[number, 1] - layout.num_people] == kind
            assert looks_past(person, thing) < 1e-9
            distances.append(math.dist(person[:2], thing[:2]))
    assert min(distances) >= 1.0
    assert 3.0 < max(distances) <= 4.0


def test_couples_walk_side_by_side():
    config, rng = config_with(interactions=[2, 2], relations=[WALKING_TOGETHER]), np.random.default_rng(0)
    for _ in range(50):
        layout = sample_layout(config, rng)
        assert layout.people_walk.all()
        assert layout.people_group.tolist() == [0, 0, 1, 1]
        for number in range(2):
            one, other = pair_of(layout, number)
            assert 0.5 <= math.dist(one[:2], other[:2]) <= 0.65
            assert one[2] == other[2]
            assert looks_past(one, other) == pytest.approx(math.pi / 2)


def test_every_relation_occurs_and_headings_go_all_ways():
    rng, config = np.random.default_rng(0), EnvConfig()
    layouts = [sample_layout(config, rng) for _ in range(300)]
    names = [name for layout in layouts for name in layout.interaction_relations]
    assert all(names.count(relation) > 0.15 * len(names) for relation in RELATIONS)
    headings = np.array([layout.robot_pose[2] for layout in layouts])
    counts, _ = np.histogram(headings, bins=4, range=(-math.pi, math.pi))
    assert counts.sum() == 300
    assert counts.min() > 45


def test_a_seed_gives_the_same_layout_and_another_seed_another():
    config = EnvConfig()
    first, second, third = (sample_layout(config, np.random.default_rng(seed)) for seed in (5, 5, 6))
    for field in dataclasses.fields(Layout):
        if isinstance(getattr(first, field.name), np.ndarray):
            assert np.array_equal(getattr(first, field.name), getattr(second, field.name))
    assert first.goal.tolist() != third.goal.tolist()


def test_what_does_not_fit_is_named():
    config = EnvConfig.from_dict(
        {"room": {"kinds": ["square"], "square_side": [6, 6]}, "population": {"tables": [20, 20]}}
    )
    with pytest.raises(ConfigError, match="population: a table found no place in a 6 x 6 m room with 4 corners in 50"):
        sample_layout(config, np.random.default_rng(0))


def test_a_goal_farther_away_than_the_room_is_long_is_refused():
    config = EnvConfig.from_dict({"robot": {"min_goal_distance": 30.0}})
    with pytest.raises(ConfigError, match="a goal within the robot's reach and 30 m away found no place"):
        sample_layout(config, np.random.default_rng(0))


def test_circles_face_their_middle_the_same_distance_apart_with_nothing_inside():
    config = config_with(circles=[1, 1], circle_size=[5, 5], still=[3, 3], plants=[3, 3])
    rng, spacings = np.random.default_rng(0), []
    for _ in range(50):
        layout = sample_layout(config, rng)
        assert_nothing_overlaps(layout, config)
        circle = layout.people_poses[:5]
        middle = circle[:, :2].mean(axis=0)
        radii = np.hypot(*(circle[:, :2] - middle).T)
        assert radii == pytest.approx(np.full(5, radii[0]))
        neighbours = np.hypot(*(circle[:, :2] - np.roll(circle[:, :2], 1, axis=0)).T)
        assert neighbours == pytest.approx(np.full(5, neighbours[0]))
        assert max(looks_past(pose, middle) for pose in circle) < 1e-9
        others = [layout.people_poses[5:, :2], layout.object_poses[:, :2], layout.robot_pose[None, :2], [layout.goal]]
        assert np.hypot(*(np.vstack(others) - middle).T).min() > radii[0]
        spacings.append(neighbours[0])
    assert 0.9 <= min(spacings) < 0.95
    assert 1.25 < max(spacings) <= 1.3


def test_a_circle_is_recorded_as_all_its_pairs_and_a_walking_group_as_its_neighbours():
    config = config_with(
        circles=[1, 1], circle_size=[3, 3], walking_groups=[1, 1], walking_group_size=[4, 4],
        interactions=[1, 1], relations=[WALKING_TOGETHER],
    )  # fmt: skip
    layout = sample_layout(config, np.random.default_rng(0))
    assert layout.interaction_pairs.tolist() == [[0, 1], [0, 2], [1, 2], [3, 4], [4, 5], [5, 6], [7, 8]]
    assert layout.interaction_relations == (TALKING,) * 3 + (WALKING_TOGETHER,) * 4
    assert layout.people_group.tolist() == [-1] * 3 + [0] * 4 + [1] * 2
    assert len(layout.interaction_pairs) == config.population.max_interactions
    assert layout.num_people == config.population.max_people


def test_a_walking_group_is_abreast():
    config = config_with(walking_groups=[1, 1], walking_group_size=[5, 5])
    rng = np.random.default_rng(0)
    for _ in range(20):
        layout = sample_layout(config, rng)
        poses = layout.people_poses
        steps = np.diff(poses[:, :2], axis=0)
        assert np.ptp(steps, axis=0) == pytest.approx([0, 0], abs=1e-9)
        assert 0.5 <= math.hypot(*steps[0]) <= 0.65
        assert looks_past(poses[0], poses[-1]) == pytest.approx(math.pi / 2)
        assert layout.people_walk.all()


def test_weights_say_how_often_relations_and_rooms_occur():
    config = EnvConfig.from_dict(
        {
            "population": NOBODY
            | {"interactions": [1, 1], "relations": [TALKING, AT_PLANT], "relation_weights": [3, 1]},
            "room": {"kinds": ["square", "l_shape"], "kind_weights": [1, 4]},
        }
    )
    rng = np.random.default_rng(0)
    layouts = [sample_layout(config, rng) for _ in range(400)]
    assert sum(layout.interaction_relations == (TALKING,) for layout in layouts) == pytest.approx(300, abs=35)
    assert sum(len(layout.room.corners) == 6 for layout in layouts) == pytest.approx(320, abs=32)


def test_counts_that_are_kept_follow_their_range_in_crowded_rooms():
    crowded = {
        "room": {"kinds": ["square"], "square_side": [4, 4]},
        "population": NOBODY | {"still": [1, 8], "max_tries": 500},
    }
    rng, means = np.random.default_rng(0), []
    for redraw in (True, False):
        config = EnvConfig.from_dict(crowded | {"population": crowded["population"] | {"redraw_counts": redraw}})
        means.append(np.mean([sample_layout(config, rng).num_people for _ in range(300)]))
    assert means[0] < 4.1
    assert means[1] == pytest.approx(4.5, abs=0.3)


def test_a_circle_that_does_not_fit_is_named():
    config = EnvConfig.from_dict(
        {"room": {"kinds": ["square"], "square_side": [4, 4]},
         "population": NOBODY | {"circles": [1, 1], "circle_size": [9, 9]}}
    )  # fmt: skip
    with pytest.raises(ConfigError, match="population: a circle of 9 found no place in a 4 x 4 m room"):
        sample_layout(config, np.random.default_rng(0))


def test_people_who_will_stand_leave_the_robot_a_way():
    config = EnvConfig.from_dict(
        {
            "room": {"kinds": ["square"], "square_side": [5, 5]},
            "population": NOBODY | {"wandering": [8, 8], "max_tries": 500},
            "people": {"model": "standing"},
        }
    )
    rng = np.random.default_rng(0)
    for _ in range(50):
        layout = sample_layout(config, rng)
        assert_goal_within_reach(dataclasses.replace(layout, people_walk=np.zeros(8, dtype=bool)), config)


@pytest.mark.slow
@pytest.mark.parametrize("groups", [{}, {"circles": [0, 2], "walking_groups": [0, 1], "max_tries": 500}])
def test_ten_thousand_layouts_have_the_counts_asked_for(groups):
    """Nothing overlaps, the goal is within reach, the median takes less than 5 ms, counts pass a chi-square test."""
    values: dict = {"population": groups | {"redraw_counts": False}}
    if groups:
        values["room"] = {"kinds": ["square"], "square_side": [9, 10]}
    config, rng = EnvConfig.from_dict(values), np.random.default_rng(0)
    sample_layout(config, rng)
    seconds, rows = [], []
    for _ in range(10_000):
        begin = time.perf_counter()
        layout = sample_layout(config, rng)
        seconds.append(time.perf_counter() - begin)
        assert_nothing_overlaps(layout, config)
        assert_goal_within_reach(layout, config)
        rows.append(counts_of(layout))
    assert np.median(seconds) < 0.005
    print(f"median {1e3 * np.median(seconds):.2f} ms, 99th percentile {1e3 * np.percentile(seconds, 99):.2f} ms")
    for name in rows[0]:
        low, high = getattr(config.population, name)
        observed = np.bincount([row[name] for row in rows], minlength=high + 1)
        assert observed[:low].sum() == 0
        chance = chisquare(observed[low : high + 1]).pvalue if high > low else 1.0
        print(f"{name} {observed.tolist()} p = {chance:.3f}")
        assert chance > 1e-3
