import gymnasium as gym
import numpy as np
import pytest

from socnav_env.config import EnvConfig, RobotConfig
from socnav_env.env import SocNavEnv
from socnav_env.recording.files import RecordTrajectory, read_recording
from socnav_env.wrappers import DiscreteActions

HOLONOMIC = EnvConfig(robot=RobotConfig(drive="holonomic"))


def test_actions_count_through_turns_first() -> None:
    env = DiscreteActions(SocNavEnv(reward="sparse"), speeds=(0.0, 1.0), turns=(-1.0, 0.0, 1.0))
    assert env.action_space == gym.spaces.Discrete(6)
    assert env.table.tolist() == [[0, -1], [0, 0], [0, 1], [1, -1], [1, 0], [1, 1]]
    assert DiscreteActions(SocNavEnv(reward="sparse")).action_space.n == 20


def test_a_holonomic_robot_also_goes_sideways() -> None:
    env = SocNavEnv(reward="sparse", config=HOLONOMIC)
    assert DiscreteActions(env).table.shape == (60, 3)
    few = DiscreteActions(env, speeds=(0.0, 1.0), turns=(0.0,), sideways=(-1.0, 1.0))
    assert few.table.tolist() == [[0, -1, 0], [0, 1, 0], [1, -1, 0], [1, 1, 0]]


@pytest.mark.parametrize("kind", [int, np.int64, np.array])
def test_the_robot_does_what_the_number_says(kind: type) -> None:
    env = DiscreteActions(SocNavEnv(reward="sparse"))
    env.reset(seed=1)
    env.step(kind(17))
    robot = env.unwrapped.config.robot
    np.testing.assert_allclose(env.unwrapped.world.command, [robot.max_forward_speed, 0.0, 0.0])
    env.step(kind(1))
    np.testing.assert_allclose(
        env.unwrapped.world.command, [-0.5 * robot.max_backward_speed, 0, -0.5 * robot.max_turn_rate]
    )


def test_episodes_are_recorded_all_the_same(tmp_path) -> None:
    env = RecordTrajectory(DiscreteActions(SocNavEnv(reward="sparse")), tmp_path)
    env.reset(seed=1)
    env.step(17)
    env.close()
    assert read_recording(tmp_path / "episode-000000.npz").trajectory.commands[0, 0] > 0.3


@pytest.mark.parametrize("action", [20, -1, 1.5, None, [1]])
def test_an_action_that_is_no_such_number_is_refused(action: object) -> None:
    env = DiscreteActions(SocNavEnv(reward="sparse"))
    env.reset(seed=1)
    with pytest.raises(ValueError, match="action must be a whole number from 0 to 19, got"):
        env.step(action)


@pytest.mark.parametrize(
    ("grid", "message"),
    [
        ({"speeds": ()}, r"speeds must be at least one number from -1 to 1, got \(\)"),
        ({"turns": (0.0, 1.1)}, r"turns must be at least one number from -1 to 1, got \(0.0, 1.1\)"),
        ({"speeds": (np.nan,)}, "speeds must be at least one number"),
    ],
)
def test_a_grid_that_leaves_the_box_is_refused(grid: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        DiscreteActions(SocNavEnv(reward="sparse"), **grid)


def test_only_boxes_of_actions_are_wrapped() -> None:
    env = DiscreteActions(SocNavEnv(reward="sparse"))
    with pytest.raises(ValueError, match=r"DiscreteActions needs SocNav2-v0's box of actions, got Discrete\(20\)"):
        DiscreteActions(env)
