import numpy as np
import pytest

from socnav_env.config.robot import COMPONENTS, DRIVES, RobotConfig
from socnav_env.simulation.actions import ACTION_RULES, action_of, action_space, command_of, scaled

DIFFERENTIAL = RobotConfig(max_forward_speed=0.3, max_backward_speed=0.2, max_turn_rate=0.5)
HOLONOMIC = RobotConfig(
    drive="holonomic", max_forward_speed=0.3, max_backward_speed=0.2, max_sideways_speed=0.1, max_turn_rate=0.5
)


@pytest.mark.parametrize(
    ("action", "command"),
    [
        ([1.0, 1.0], [0.3, 0.0, 0.5]),
        ([-1.0, -1.0], [-0.2, 0.0, -0.5]),
        ([0.5, -0.5], [0.15, 0.0, -0.25]),
        ([7.0, -9.0], [0.3, 0.0, -0.5]),
        ([0, 0], [0.0, 0.0, 0.0]),
    ],
)
def test_actions_are_shares_of_the_top_speeds_and_clipped(action: list[float], command: list[float]) -> None:
    np.testing.assert_allclose(command_of(action, DIFFERENTIAL), command)


@pytest.mark.parametrize(
    ("action", "command"),
    [
        ([1.0, 0.0, 1.0], [0.3, 0.0, 0.5]),
        ([0.0, -1.0, 0.0], [0.0, -0.1, 0.0]),
        ([0.3, 0.4, 0.0], [0.09, 0.04, 0.0]),  # shorter than 1: as it is
        ([3.0, -4.0, 0.0], [0.3 * 0.5**0.5, -0.1 * 0.5**0.5, 0.0]),  # clipped first, then shortened
        ([-1.0, 1.0, -2.0], [-0.2 * 0.5**0.5, 0.1 * 0.5**0.5, -0.5]),
    ],
)
def test_a_holonomic_robot_goes_everywhere_but_not_faster(action: list[float], command: list[float]) -> None:
    np.testing.assert_allclose(command_of(action, HOLONOMIC), command)


@pytest.mark.parametrize(("robot", "size"), [(DIFFERENTIAL, 2), (HOLONOMIC, 3)])
def test_an_action_and_back(robot: RobotConfig, size: int) -> None:
    space = action_space(robot)
    assert space.shape == (size,)
    space.seed(0)
    for _ in range(50):
        action = space.sample()
        action[:-1] /= max(1.0, float(np.hypot.reduce(action[:-1])))
        np.testing.assert_allclose(action_of(command_of(action, robot), robot), action, atol=1e-6)


def test_a_robot_that_cannot_reverse_stands_instead() -> None:
    robot = RobotConfig(max_backward_speed=0.0)
    np.testing.assert_array_equal(command_of([-1.0, 0.0], robot), [0.0, 0.0, 0.0])
    np.testing.assert_array_equal(action_of(np.array([-0.1, 0.0, 0.0]), robot), [0.0, 0.0])


@pytest.mark.parametrize("action", [np.zeros(2), np.zeros(4), [0.0, np.nan, 0.0], None])
def test_three_numbers_are_asked_for_by_name(action: object) -> None:
    with pytest.raises(ValueError, match=r"action must be three finite numbers \(forward, left, turn\), got"):
        command_of(action, HOLONOMIC)


def test_every_drive_has_a_rule() -> None:
    assert set(ACTION_RULES) == set(DRIVES)


@pytest.mark.parametrize("name", DRIVES)
def test_commands_stay_within_what_the_drive_can_do(name: str) -> None:
    robot, drive = RobotConfig(drive=name), DRIVES[name]
    actions = np.random.default_rng(0).uniform(-1.5, 1.5, (200, len(drive.axes)))
    commands = scaled(actions, robot)
    still = [place for place, component in enumerate(COMPONENTS) if component not in drive.moves]
    assert commands.shape == (200, 3)
    assert not commands[:, still].any()
    assert np.hypot(commands[:, 0], commands[:, 1]).max() <= robot.top_speed + 1e-12
    for action, command in zip(actions, commands, strict=True):
        np.testing.assert_array_equal(command_of(action, robot), command)
        np.testing.assert_allclose(command_of(action_of(command, robot), robot), command, atol=1e-12)


def test_only_the_drive_that_was_rated_is_in_the_rated_range() -> None:
    assert [name for name in DRIVES if RobotConfig(drive=name).in_rated_range] == ["differential"]
