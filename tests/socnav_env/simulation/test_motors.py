import numpy as np
import pytest

from socnav_env.config import RobotConfig
from socnav_env.simulation.motors import Motors, approach

FULL = (3.5 / 9.4, 0.0, 4 / 10.32)


def velocity(motors: Motors, duration: float) -> tuple[float, ...]:
    approach(motors.motion, duration)
    return tuple(motors.motion.velocity.tolist())


class NoRandomness:
    def standard_normal(self, size: int) -> np.ndarray:
        raise AssertionError("nothing is to be drawn")


def test_by_default_a_robot_does_what_it_is_told_and_draws_nothing() -> None:
    motors = Motors(RobotConfig())
    motors.command(np.array([0.1, 0.0, -0.2]), NoRandomness())
    assert velocity(motors, 0.05) == (0.1, 0.0, -0.2)


def test_speed_and_turn_rate_rise_at_most_so_fast() -> None:
    motors = Motors(RobotConfig(max_acceleration=1.0, max_turn_acceleration=2.0))
    motors.command(np.array([0.12, 0.0, -0.15]), NoRandomness())
    assert velocity(motors, 0.05) == pytest.approx((0.05, 0.0, -0.1))
    assert velocity(motors, 0.05) == pytest.approx((0.1, 0.0, -0.15))
    assert velocity(motors, 0.05) == pytest.approx((0.12, 0.0, -0.15))
    motors.command(np.array([-0.12, 0.0, 0.0]), NoRandomness())
    assert velocity(motors, 0.1) == pytest.approx((0.02, 0.0, 0.0))


def test_the_velocity_of_a_holonomic_robot_is_limited_as_a_vector() -> None:
    motors = Motors(RobotConfig(drive="holonomic", max_acceleration=1.0))
    motors.command(np.array([0.3, -0.4, 0.2]), NoRandomness())
    assert velocity(motors, 0.1) == pytest.approx((0.06, -0.08, 0.2))


def test_after_a_stop_speed_is_taken_up_anew() -> None:
    motors = Motors(RobotConfig(max_acceleration=1.0))
    motors.command(np.array([0.3, 0.0, 0.0]), NoRandomness())
    for _ in range(10):
        velocity(motors, 0.05)
    motors.resume(np.zeros(3))
    assert velocity(motors, 0.05) == pytest.approx((0.05, 0.0, 0.0))


@pytest.mark.parametrize(("drive", "moves"), [("differential", [0, 2]), ("holonomic", [0, 1, 2])])
def test_noise_has_the_deviation_asked_for_and_grows_with_the_command(drive: str, moves: list[int]) -> None:
    motors, rng = Motors(RobotConfig(drive=drive, speed_noise=0.1, turn_noise=0.2)), np.random.default_rng(0)

    def errors(share: float) -> np.ndarray:
        command = np.array(FULL) * share
        told = []
        for _ in range(3000):
            motors.command(command, rng)
            told.append(velocity(motors, 0.05))
        return np.array(told) - command

    full, half, standing = errors(1.0), errors(0.5), errors(0.0)
    deviations = np.array([0.1, 0.1, 0.2])[moves]
    np.testing.assert_allclose(full.std(axis=0)[moves], deviations, rtol=0.05)
    np.testing.assert_allclose(half.std(axis=0)[moves], deviations / 2, rtol=0.05)
    assert not standing.any()
    assert (np.abs(full[:, moves]) <= 3 * deviations + 1e-12).all()
    assert len(moves) == 3 or not full[:, 1].any()
