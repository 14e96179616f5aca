import gymnasium as gym
import numpy as np
import pytest
from gymnasium import spaces
from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from agents.envs import MONITORED
from agents.vector import SB3VecEnv
from socnav_env.config import EnvConfig
from socnav_env.env import SocNavEnv
from socnav_env.vector.env import SocNavVectorEnv
from tests.agents.disc import DiscEnv

NUM_ENVS = 3
CONFIG = EnvConfig.from_dict({"time_limit": 2.0, "robot": {"max_forward_speed": 4.0}})  # 10 steps, some touch something


class FeatureScorer:
    name = "features"

    def score_windows(self, windows) -> np.ndarray:
        sums = [sum(float(frame.arrays.features.sum()) for frame in window) for window in windows]
        return np.array([[np.sin(value) ** 2, np.cos(value) ** 2] for value in sums], dtype=np.float32)


@pytest.fixture(autouse=True)
def without_weights(monkeypatch: pytest.MonkeyPatch) -> None:
    from socnav_env import rewards

    scorer = FeatureScorer()
    monkeypatch.setattr(rewards, "shared_scorer", lambda weights: scorer)


class RepeatedAction(gym.Wrapper):
    """What an action that lasts several control steps should do, in the simplest way."""

    def __init__(self, env: gym.Env, times: int) -> None:
        super().__init__(env)
        self.times = times

    def step(self, action: np.ndarray) -> tuple:
        rewards, infos = [], []
        for _ in range(self.times):
            observation, reward, terminated, truncated, info = self.env.step(action)
            rewards.append(reward)
            infos.append(info)
            if terminated or truncated:
                break
        if self.times > 1:
            info = {**info, "control_steps": len(infos)}
            terms = [each["reward_terms"] for each in infos]
            info["reward_terms"] = {name: sum(each[name] for each in terms) for name in terms[0]}
            for name in {"q1", "q2"} & set(info):
                info[name] = np.mean([each[name] for each in infos])
        return observation, sum(rewards), terminated, truncated, info


def make(action_repeat: int = 1, **arguments) -> SB3VecEnv:
    return SB3VecEnv(SocNavVectorEnv(NUM_ENVS, "SameStep", action_repeat, **{"config": CONFIG, **arguments}))


def make_dummy(action_repeat: int, reward: str) -> DummyVecEnv:
    def single() -> RepeatedAction:
        return RepeatedAction(Monitor(SocNavEnv(reward=reward, config=CONFIG), info_keywords=MONITORED), action_repeat)

    return DummyVecEnv([single] * NUM_ENVS)


def assert_same(one, other) -> None:
    assert set(one) == set(other)
    for key, value in one.items():
        if isinstance(value, dict):
            assert_same(value, other[key])
        elif key == "t":
            assert value == pytest.approx(other[key], abs=60)  # s
        elif value is None or isinstance(value, str):
            assert value == other[key]
        else:
            np.testing.assert_allclose(value, other[key], atol=1e-5)


@pytest.mark.parametrize("action_repeat", [1, 4])
@pytest.mark.parametrize("reward", ["learned", "crowdnav"])
def test_everything_is_what_monitored_environments_give(reward: str, action_repeat: int) -> None:
    envs, expected = make(action_repeat, reward=reward), make_dummy(action_repeat, reward)
    for each in (envs, expected):
        each.seed(3)
    assert_same(envs.reset(), expected.reset())
    random, ends = np.random.default_rng(0), set()
    for _ in range(24 // action_repeat):
        actions = random.uniform(-1, 1, (NUM_ENVS, 2)).astype(np.float32)
        played, wanted = envs.step(actions), expected.step(actions)
        assert_same(played[0], wanted[0])
        np.testing.assert_allclose(played[1], wanted[1], atol=1e-5)
        assert played[1].dtype == wanted[1].dtype
        np.testing.assert_array_equal(played[2], wanted[2])
        for mine, theirs in zip(played[3], wanted[3], strict=True):
            assert_same(mine, theirs)
        for mine, theirs in zip(envs.reset_infos, expected.reset_infos, strict=True):
            assert_same(mine, theirs)
        ends |= {info["TimeLimit.truncated"] for info, done in zip(played[3], played[2], strict=True) if done}
    assert ends == {True, False}


def test_an_agent_learns_and_is_evaluated_on_it() -> None:
    envs = make(reward="sparse")
    assert isinstance(envs.observation_space, spaces.Dict)
    model = PPO("MultiInputPolicy", VecNormalize(envs, norm_obs=False), n_steps=16, batch_size=48, n_epochs=1, seed=0)
    model.learn(48)
    assert model.num_timesteps == 48
    assert {episode["l"] for episode in model.ep_info_buffer} <= set(range(1, 11))
    returns, lengths = evaluate_policy(model, envs, n_eval_episodes=3, return_episode_rewards=True)
    assert len(returns) == len(lengths) == 3


def test_attributes_methods_and_pictures() -> None:
    envs = make(reward="sparse", render_mode="rgb_array")
    envs.seed(5)
    envs.reset()
    assert envs.get_attr("time_left", indices=[0, 2]) == [1.0, 1.0]
    assert envs.env_method("window", indices=1) == [[]]
    assert envs.env_is_wrapped(Monitor) == [True] * 3
    assert envs.env_is_wrapped(RepeatedAction) == [False] * 3
    envs.set_attr("render_mode", "human", indices=0)
    assert envs.get_attr("render_mode") == ["human", "rgb_array", "rgb_array"]
    envs.set_attr("render_mode", "rgb_array")
    assert len(envs.get_images()) == 3
    assert envs.render().dtype == np.uint8
    envs.close()


def test_options_are_refused() -> None:
    envs = make(reward="sparse")
    envs.set_options({"room": "big"})
    with pytest.raises(ValueError, match=r"reset has no options, got \{'room': 'big'\}"):
        envs.reset()


def test_worlds_must_begin_anew_in_the_step_that_ends_an_episode() -> None:
    with pytest.raises(ValueError, match="autoreset_mode must be SameStep, got"):
        SB3VecEnv(SocNavVectorEnv(2, reward="sparse", config=CONFIG))


def test_toy_environments_fit_in() -> None:
    envs = SB3VecEnv(DiscEnv.vector(2, 0, 1))
    envs.seed(1)
    envs.reset()
    for _ in range(60):
        _, _, dones, infos = envs.step(np.zeros((2, 2), np.float32))
    assert dones.tolist() == [True, True]
    assert [(info["episode"]["l"], info["TimeLimit.truncated"]) for info in infos] == [(60, True)] * 2
    assert infos[0]["terminal_observation"]["robot"].tolist() == [0.0, 0.0, 0.0, 0.0]
    assert infos[0]["episode_metrics"]["success"] == 0.0
    assert envs.env_method("render", indices=[0, 1])[0].shape == (32, 32, 3)
    with pytest.raises(ValueError, match="indices must name all 2 environments here, got \\[1\\]"):
        envs.env_method("render", indices=[1])
