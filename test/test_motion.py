"""Commanded motions: numbers, ramps and functions of time, followed exactly."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from hma_gripper_sim import InputError
from hma_gripper_sim.kernels.base_motion import Motion
from hma_gripper_sim.motion import evaluate, follow, of_ticks, part_of, ramp, through_points


def test_constant_velocity_is_one_segment() -> None:
    """x = x0 + v t, with a jump at the start."""
    motion = follow(0.004, start=2.0, travel=0.01, duration=7.0)
    assert len(motion.velocity) == 1
    assert motion.jump[0]
    travel, velocity, acceleration = evaluate(motion, np.array([2.0, 5.5, 9.0]))
    np.testing.assert_allclose(travel, [0.01, 0.024, 0.038], rtol=1e-14)
    np.testing.assert_allclose(velocity, 0.004, rtol=1e-14)
    assert not acceleration.any()
    assert motion.time[-1] == 9.0


def test_ramp() -> None:
    """x = x0 + v0 t + a t^2 / 2 over the ramp."""
    motion = ramp(1.0, 0.002, 0.5, 0.004, -0.002, False)
    assert not motion.jump[0]
    assert motion.velocity[0] == pytest.approx([0.004, -0.012])
    assert motion.travel[-1] == pytest.approx(0.002 + 0.5 * (0.004 - 0.002) / 2.0)


@@FUNCTIONS@@
@pytest.mark.parametrize("bad", [math.nan, math.inf, "3 kg", None, [0.004], True, 1j])
def test_bad_velocity(bad: object) -> None:
    """A value that is no finite velocity: refused as a number, and with the time in a function."""
    with pytest.raises(InputError) as refusal:
        follow(bad, 0.0, 0.0, 1.0)  # type: ignore[arg-type]
    assert refusal.value.field == "velocity"
    with pytest.raises(InputError, match=r"at t = 0\.") as refusal:
        follow(lambda t: 0.004 if t < 0.5 else bad, 0.0, 0.0, 1.0)  # type: ignore[return-value, arg-type]
    assert refusal.value.field == "velocity"


def test_ticks_are_joined_where_the_acceleration_stays() -> None:
    """A ramp of 3 ticks, 20 at constant velocity, and a ramp of 2 to rest; travel as summed up."""
    velocity = np.array([0.0, 1.0, 2.0, 3.0, *[3.0] * 20, 1.5, 0.0]) * 1e-3
    travel = np.concatenate([[0.5], 0.5 + np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * 0.01)])
    motion = of_ticks(2.0, 0.01, travel, velocity)
    assert len(motion.velocity) == 3
    assert motion.jump.all()
    time = 2.0 + 0.01 * np.arange(len(velocity))
    got_travel, got_velocity, _ = evaluate(motion, time)
    np.testing.assert_allclose(got_travel, travel, rtol=0, atol=1e-15)
    np.testing.assert_allclose(got_velocity, velocity, rtol=0, atol=1e-15)


def test_lines_through_points() -> None:
    """Δx / Δt between the points that are kept; a point on the line between others is not."""
    motion = through_points(
        np.array([0.0, 1.0, 2.0, 4.0]), np.array([0.0, 0.001, 0.002, 0.0]), 1e-6
    )
    np.testing.assert_allclose(motion.time, [0.0, 2.0, 4.0])
    np.testing.assert_allclose(motion.velocity, [[0.001], [-0.001]])
    assert motion.jump.all()


@pytest.mark.parametrize(("start", "end"), [(0.0, 9.0), (0.5, 3.25), (2.0, 6.5), (2.5, 2.75)])
def test_part_of_a_motion_is_the_same_there(start: float, end: float) -> None:
    whole = follow(lambda t: 0.001 * t if t < 2.0 else 0.004, 0.0, 0.01, 9.0)
    part = part_of(whole, start, end)
    assert (part.time[0], part.time[-1]) == (start, end)
    inside = np.linspace(start, end, 50)[1:-1]
    for got, expected in zip(evaluate(part, inside), evaluate(whole, inside), strict=True):
        np.testing.assert_allclose(got, expected, rtol=0, atol=1e-15)
    assert part.travel[-1] == pytest.approx(evaluate(whole, np.array([end]))[0][0], abs=1e-15)
    # Only where the whole one jumps does its part.
    assert part.jump[0] == any(
        start == t and j for t, j in zip(whole.time, whole.jump, strict=False)
    )
