from dataclasses import replace

import numpy as np
import pytest

from reward_model.analysis.heatmap import score_positions
from reward_model.scenes.scene import ScenarioError, SceneSequence
from socnav_env.env import SocNavEnv
from socnav_env.geometry.frames import points_in_frame
from socnav_env.rendering.heat_overlay import heat_of
from socnav_env.scenes.rooms import l_room


def test_every_place_in_the_room_is_scored_where_it_is(feature_reward) -> None:
    env = SocNavEnv(feature_reward, scenario="blind_corner")
    env.reset(seed=2)
    sequence = env._scene().recent_sequence()
    room = env.world.layout.room
    heat = heat_of(feature_reward.scorer, sequence, room, resolution=8)
    assert (heat.low.tolist(), heat.high.tolist(), heat.scores.shape) == ([-4, -4], [4, 4], (8, 8))
    outside = np.isnan(heat.scores)
    assert outside[3:, :5].all()  # the corner that the L lacks
    assert outside.sum() == 25
    place = np.array([[-3.5, 0.5]])
    score = score_positions(feature_reward.scorer, sequence, points_in_frame(env.world.robot_pose, place))[0, 1]
    assert heat.scores[0, 4] == pytest.approx(score, abs=1e-6)


def test_a_scene_must_know_where_the_robot_is(feature_reward) -> None:
    env = SocNavEnv(feature_reward)
    env.reset(seed=0)
    sequence = env._scene().recent_sequence()

    blind = SceneSequence(tuple(replace(each, robot_pose=None) for each in sequence), "blind")
    with pytest.raises(ScenarioError, match="blind: a heatmap of the room needs robot_pose"):
        heat_of(feature_reward.scorer, blind, l_room(3))


def test_without_a_scorer_there_is_no_heatmap() -> None:
    env = SocNavEnv("sparse")
    env.reset(seed=0)
    with pytest.raises(ValueError, match="a heatmap needs a learned reward"):
        env.frame(heatmap=True)
