import math

import numpy as np
import pytest

from reward_model.base.angles import wrap_angle, wrap_angles, wrap_heading

BELOW_PI, ABOVE_PI = math.nextafter(math.pi, 0.0), math.nextafter(math.pi, 4.0)
HALF_OPEN = [
    (0.0, 0.0),
    (1.0, 1.0),
    (math.pi, -math.pi),
    (-math.pi, -math.pi),
    (3 * math.pi, -math.pi),
    (-3 * math.pi, -math.pi),
    (3.5 * math.pi, -0.5 * math.pi),
    (-3.5 * math.pi, 0.5 * math.pi),
    (200 * math.pi + 1.0, 1.0),
    (-200 * math.pi - 1.0, -1.0),
]


@pytest.mark.parametrize(("angle", "wrapped"), HALF_OPEN)
def test_half_a_turn_is_negative(angle: float, wrapped: float) -> None:
    assert wrap_angle(angle) == pytest.approx(wrapped, abs=1e-12)
    assert wrap_angles(np.array([angle]))[0] == pytest.approx(wrapped, abs=1e-12)


def test_an_angle_within_half_a_turn_is_kept_to_the_last_bit() -> None:
    for angle in (0.1, -3.0, 1e-20, -math.pi):
        assert wrap_angle(angle) == angle
    assert wrap_angle(math.pi) == -math.pi
    assert wrap_angle(-BELOW_PI) == -BELOW_PI


def test_arrays_keep_their_shape_and_are_not_written_to() -> None:
    angles = np.array([[0.0, 4.0], [-4.0, 7.0]])
    expected = [[0.0, 4.0 - 2 * math.pi], [2 * math.pi - 4.0, 7.0 - 2 * math.pi]]
    np.testing.assert_allclose(wrap_angles(angles), expected, atol=1e-12)
    assert angles.tolist() == [[0.0, 4.0], [-4.0, 7.0]]


@pytest.mark.parametrize(
    ("heading", "wrapped"),
    [
        (0.0, 0.0),
        (math.pi, math.pi),
        (-math.pi, -math.pi),
        (ABOVE_PI, ABOVE_PI - 2 * math.pi),
        (-ABOVE_PI, 2 * math.pi - ABOVE_PI),
        (BELOW_PI, BELOW_PI),
        (2 * math.pi, 0.0),
        (-2 * math.pi, 0.0),
        (7.0, 7.0 - 2 * math.pi),
        (-5.0, 2 * math.pi - 5.0),
    ],
)
def test_a_heading_keeps_the_sign_of_half_a_turn(heading: float, wrapped: float) -> None:
    assert wrap_heading(heading) == wrapped


@pytest.mark.parametrize(("heading", "size"), [(3 * math.pi, math.pi), (-3 * math.pi, math.pi), (200 * math.pi, 0.0)])
def test_headings_of_many_turns(heading: float, size: float) -> None:
    assert abs(wrap_heading(heading)) == pytest.approx(size, abs=1e-12)


def test_for_eight_turns_a_heading_is_wrapped_exactly() -> None:
    for heading in np.random.default_rng(0).uniform(-16 * math.pi, 16 * math.pi, 2000).tolist():
        assert wrap_heading(heading) == math.remainder(heading, 2 * math.pi)
