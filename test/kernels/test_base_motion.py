"""The motion of the base: a polynomial of time on each segment, and where one follows another."""

from __future__ import annotations

import numpy as np
import pytest

from hma_gripper_sim.kernels.base_motion import Motion, base_motion

MOTION = Motion(
    np.array([1.0, 1.5, 2.5]),
    np.array([0.002, 0.007, 0.001]),
    np.array([[0.004, -0.012, 0.03, 0.5], [-0.002, 0.001, 0.0, -0.2]]),
    np.array([True, False]),
)


def at(motion: Motion, segment: int, t: float) -> np.ndarray:
    base = np.empty(3)
    base_motion(motion, segment, t, base)
    return base


@pytest.mark.parametrize(("t", "segment"), [(1.0, 0), (1.25, 0), (1.5, 0), (1.6, 1), (2.5, 1)])
def test_height_velocity_and_acceleration_are_those_of_the_polynomial(
    t: float, segment: int
) -> None:
    """Minus the travel, the velocity and its derivative, however many segments on `t` is."""
    velocity = np.polynomial.Polynomial(MOTION.velocity[segment])
    dt = t - MOTION.time[segment]
    travel = MOTION.travel[segment] + velocity.integ()(dt)
    expected = [-travel, -velocity(dt), -velocity.deriv()(dt)]
    np.testing.assert_allclose(at(MOTION, 0, t), expected, rtol=1e-13, atol=1e-17)


def test_a_jump_is_not_passed() -> None:
    """A step that ends at a jump ends before it, although rounding puts its end behind it."""
    jumping = MOTION._replace(jump=np.array([True, True]))
    behind = np.nextafter(1.5, 2.0)
    np.testing.assert_allclose(at(jumping, 0, behind), at(MOTION, 0, 1.5), rtol=1e-12)


def test_a_constant_velocity_is_exact_over_hours() -> None:
    """x = x0 + v t to the last digit."""
    motion = Motion(
        np.array([0.0, 1e4]), np.array([0.0, 40.0]), np.array([[0.004]]), np.ones(1, bool)
    )
    np.testing.assert_array_equal(at(motion, 0, 9876.5), [-(0.004 * 9876.5), -0.004, 0.0])
