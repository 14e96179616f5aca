import numpy as np
import pytest

from reward_model.graph.features import NodeKind, Relation
from reward_model.graph.windows import scene_graph
from socnav_env.config import EnvConfig, PopulationConfig, RewardConfig, RoomConfig
from socnav_env.env import SocNavEnv
from socnav_env.observations import GraphObservation
from socnav_env.observations.graph import fitted_frames, most_segments
from socnav_env.scenes.population import sample_layout

CROWDED = PopulationConfig(still=(4, 4), wandering=(4, 4), tables=(0, 0), plants=(3, 3), interactions=(3, 3))


def played(config: EnvConfig, seed: int, steps: int = 3) -> tuple[SocNavEnv, dict[str, np.ndarray]]:
    env = SocNavEnv(reward="sparse", observation="graph", config=config)
    seen, _ = env.reset(seed=seed)
    for _ in range(steps):
        seen = env.step(np.array([1.0, 0.3]))[0]
    return env, seen


def test_the_agent_reads_what_the_reward_reads() -> None:
    env, seen = played(EnvConfig(), seed=1)
    graph = scene_graph(env.window())
    nodes, edges = len(graph.features), len(graph.sources)
    np.testing.assert_array_equal(seen["nodes"].reshape(-1, 42)[:nodes], graph.features)
    assert not seen["nodes"][nodes * 42 :].any()
    assert (seen["nodes_mask"].sum(), seen["edges_mask"].sum()) == (nodes, edges)
    for name in ("sources", "targets", "relations", "lengths"):
        np.testing.assert_array_equal(seen[name][:edges], getattr(graph, name))
        assert not seen[name][edges:].any()
    np.testing.assert_allclose(seen["robot"][3], 1 - 3 / 300)


def test_the_agent_reads_real_time_where_the_reward_reads_slowed_time(feature_reward) -> None:
    steps = {}
    for time_scale in (1.0, 2.5):
        env = SocNavEnv(feature_reward, "graph", EnvConfig(reward=RewardConfig(time_scale=time_scale)))
        observations, scores = [env.reset(seed=1)[0]], []
        for _ in range(3):
            seen, _, _, _, info = env.step(np.array([1.0, 0.3]))
            observations.append(seen)
            scores.append(info["q2"])
        steps[time_scale] = observations, scores
    for seen, expected in zip(steps[2.5][0], steps[1.0][0], strict=True):
        for name, values in expected.items():
            np.testing.assert_array_equal(seen[name], values)
    assert steps[2.5][1] != steps[1.0][1]


def test_without_a_warm_up_the_graph_begins_with_one_frame() -> None:
    env, seen = played(EnvConfig(warm_up=0.0), seed=1, steps=0)
    assert seen["nodes_mask"].sum() == len(env.window()[0])


@pytest.mark.parametrize("population", [PopulationConfig(), CROWDED])
def test_there_is_room_for_every_scene_that_the_config_makes(population: PopulationConfig) -> None:
    config = EnvConfig(population=population)
    graph = GraphObservation(config)
    for seed in range(6):
        env = SocNavEnv(reward="sparse", observation="graph", config=config)
        env.reset(seed=seed)
        window = env.window()
        assert fitted_frames(window, graph.max_nodes, graph.max_links) == window
        assert max(len(frame.arrays.link_sources) for frame in window) <= graph.max_links / 2


def test_wall_segments_are_counted_as_the_graph_cuts_them() -> None:
    assert most_segments(RoomConfig(kinds=("square",), square_side=(6, 8), rectangle_side=(5, 6), l_unit=(1, 1))) == 36
    assert most_segments(RoomConfig()) == 54
    config = EnvConfig(room=RoomConfig(kinds=("l_shape",), l_unit=(4, 4)))
    env, _ = played(config, seed=0, steps=0)
    assert (env.window()[0].arrays.kinds == NodeKind.WALL).sum() == 54


def test_of_too_large_a_graph_the_nearest_nodes_and_shortest_links_are_left() -> None:
    env, _ = played(EnvConfig(population=CROWDED), seed=2)
    window = env.window()
    frames = fitted_frames(window, max_nodes=20, max_links=8)
    for frame, whole in zip(frames, window, strict=True):
        assert len(frame) == 20
        assert frame.arrays.kinds[0] == NodeKind.ROOM
        assert NodeKind.GOAL in frame.arrays.kinds
        assert len(frame.arrays.link_sources) <= 8
        rows = [
            np.flatnonzero((whole.arrays.features == features).all(axis=1)).size for features in frame.arrays.features
        ]
        assert min(rows) >= 1
        ends = frame.arrays.keys[np.concatenate([frame.arrays.link_sources, frame.arrays.link_targets])]
        assert set(ends) <= set(frame.arrays.keys)
    kept = np.isin(window[0].arrays.keys, frames[0].arrays.keys)
    kinds = window[0].arrays.kinds != NodeKind.GOAL
    assert window[0].arrays.lengths[kept & kinds].max() <= window[0].arrays.lengths[~kept & kinds].min()
    graph = scene_graph(frames)
    people = graph.relations == Relation.PERSON_PERSON
    assert (graph.features[graph.sources[people], NodeKind.PERSON] == 1).all()


def test_links_between_people_go_before_those_to_walls() -> None:
    env, _ = played(EnvConfig(population=CROWDED), seed=2)
    (whole,) = window = env.window()[:1]
    interactions = int((~np.isin(whole.arrays.link_relations, (Relation.PERSON_WALL, Relation.WALL_PERSON))).sum())
    assert interactions >= 6
    (frame,) = fitted_frames(window, max_nodes=999, max_links=interactions + 2)
    assert len(frame.arrays.link_sources) == interactions + 2
    walls = np.isin(whole.arrays.link_relations, (Relation.PERSON_WALL, Relation.WALL_PERSON))
    assert frame.arrays.link_lengths[-2:].tolist() == pytest.approx([whole.arrays.link_lengths[walls].min()] * 2)


def test_layouts_are_those_of_other_observations() -> None:
    config = EnvConfig()
    _, seen = played(config, seed=7, steps=0)
    people = sample_layout(config, np.random.default_rng(7)).num_people
    assert seen["nodes"].reshape(-1, 42)[0, 30] == pytest.approx(people / 15)
