"""Moves from rest to rest, as the spline through their way points."""

from __future__ import annotations

import numpy as np
import pytest

from hma_gripper_sim.motion.trajectory import Trajectory
from hma_gripper_sim.motion.trapezoid import trapezoid

START = 0.003
TICK = 0.01


def motion(distance, speed, acceleration):
    """Times, positions and velocities of a move from `START`, at each tick."""
    trajectory = Trajectory(trapezoid(START, distance, speed, acceleration, TICK))
    spline = trajectory.spline(0.0, START, 0.0)
    times = TICK * np.arange(round(trajectory.end / TICK) + 1)
    return times, *np.array([spline.at(t) for t in times]).T


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_long_way_has_ramps_and_a_constant_speed(sign):
    distance, speed, acceleration = sign * 0.02, 0.01, 0.05
    times, position, velocity = motion(distance, speed, acceleration)
    # Two ramps of v/a, each as long as half of it at full speed: t = d/v + v/a.
    assert times[-1] == pytest.approx(abs(distance) / speed + speed / acceleration, rel=1e-12)
    ramp = np.clip(np.minimum(times, times[-1] - times) * acceleration, 0.0, speed)
    assert velocity == pytest.approx(sign * ramp, abs=1e-12)
    assert position[-1] - START == pytest.approx(distance, abs=1e-15)


def test_a_short_way_is_two_ramps():
    distance, acceleration = 0.0005, 0.05
    times, _, velocity = motion(distance, 0.01, acceleration)
    assert len(trapezoid(START, distance, 0.01, acceleration, TICK)) == 2
    assert times[-1] == pytest.approx(
        2.0 * np.sqrt(distance / acceleration), rel=1e-12
    )  # d = a t²/4
    assert velocity.max() == pytest.approx(np.sqrt(distance * acceleration), rel=1e-12)


@pytest.mark.parametrize("distance", [1e-12, 1e-6, 0.00037, 0.0042, -0.0281, 0.5])
def test_whatever_the_way_ticks_are_kept_exactly_within_the_limits(distance):
    speed, acceleration = 0.0123, 0.31
    _, position, velocity = motion(distance, speed, acceleration)
    assert position[-1] - START == pytest.approx(distance, abs=1e-15)
    assert np.abs(velocity).max() <= speed * (1 + 1e-12)
    assert np.abs(np.diff(velocity)).max() <= acceleration * TICK * (1 + 1e-9)
    # Velocity is linear within each tick: the trapezoidal rule gives the travel.
    steps = 0.5 * TICK * (velocity[1:] + velocity[:-1])
    assert np.diff(position) == pytest.approx(steps, abs=1e-14)
    # No slower than two ticks more than it takes.
    fastest = min(speed, np.sqrt(abs(distance) * acceleration))
    ideal = abs(distance) / fastest + fastest / acceleration
    assert TICK * (len(position) - 1) <= ideal + 3.0 * TICK


def test_no_way_needs_no_points():
    assert trapezoid(START, 0.0, 0.01, 0.05, TICK) == []
