"""Commanded motions: numbers, ramps and functions of time, followed exactly."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from hma_gripper_sim import InputError
from hma_gripper_sim.kernels.base_motion import Motion
from hma_gripper_sim.motion import follow, of_ticks, part_of, ramp, through_points


def evaluate(motion: Motion, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Travel and velocity of a motion at given times, by its definition."""
    i = np.clip(np.searchsorted(motion.time, time, side="right") - 1, 0, len(motion.velocity) - 1)
    dt = time - motion.time[i]
    velocity = motion.velocity[i] + motion.acceleration[i] * dt
    travel = motion.travel[i] + dt * (motion.velocity[i] + 0.5 * motion.acceleration[i] * dt)
    return travel, velocity


def test_constant_velocity_is_one_segment() -> None:
    """x = x0 + v t, with a jump at the start."""
    motion = follow(0.004, start=2.0, travel=0.01, duration=7.0)
    assert len(motion.velocity) == 1
    assert motion.jump[0]
    travel, velocity = evaluate(motion, np.array([2.0, 5.5, 9.0]))
    np.testing.assert_allclose(travel, [0.01, 0.024, 0.038], rtol=1e-14)
    np.testing.assert_allclose(velocity, 0.004, rtol=1e-14)
    assert motion.time[-1] == 9.0


def test_ramp() -> None:
    """x = x0 + v0 t + a t^2 / 2 over the ramp."""
    motion = ramp(1.0, 0.002, 0.5, 0.004, -0.002, False)
    assert not motion.jump[0]
    assert motion.acceleration[0] == pytest.approx(-0.012)
    assert motion.travel[-1] == pytest.approx(0.002 + 0.5 * (0.004 - 0.002) / 2.0)


@pytest.mark.parametrize("at", [2.0, 1.23456789, 1e-3, 6.9999])
def test_a_jump_is_located(at: float) -> None:
    """A step in the command is kept as a jump, where it is to a nanosecond, and nothing else."""
    motion = follow(lambda t: 0.004 if t < at else -0.001, 0.0, 0.0, 7.0)
    jumps = motion.time[:-1][motion.jump]
    assert len(jumps) == 2
    assert jumps[0] == 0.0
    assert jumps[1] == pytest.approx(at, abs=2e-8)
    assert motion.travel[-1] == pytest.approx(0.004 * at - 0.001 * (7.0 - at), abs=1e-10)


@pytest.mark.parametrize(
    ("velocity", "integral"),
    [
        (lambda t: 0.01 * math.sin(3.0 * t), lambda t: 0.01 / 3.0 * (1.0 - math.cos(3.0 * t))),
        (lambda t: 0.002 * t, lambda t: 0.001 * t * t),
        (lambda t: 0.004 * abs(t - 1.7), lambda t: 0.002 * (1.7**2 + (t - 1.7) * abs(t - 1.7))),
        (lambda t: 0.004 * math.tanh(50.0 * (t - 2.0)), None),
    ],
)
def test_functions_are_followed(
    velocity: Callable[[float], float], integral: Callable[[float], float] | None
) -> None:
    """Straight lines stay within 1e-4 of the largest velocity, and the travel is its integral."""
    motion = follow(velocity, 0.0, 0.0, 4.0)
    time = np.linspace(0.0, 4.0, 4001)
    travel, followed = evaluate(motion, time)
    wanted = np.array([velocity(float(t)) for t in time])
    np.testing.assert_allclose(followed, wanted, atol=1.2e-4 * np.abs(wanted).max())
    if integral is not None:
        exact = np.array([integral(float(t)) for t in time])
        np.testing.assert_allclose(travel, exact, atol=1e-4 * np.abs(wanted).max() * 4.0)
    continuous = ~motion.jump[1:]
    assert continuous.all()


def test_steps_of_a_staircase() -> None:
    """A command held for 20 ms at a time (a bus, a log) keeps every step."""
    motion = follow(lambda t: 0.001 * math.floor(t / 0.02 + 1e-9), 0.0, 0.0, 0.199)
    jumps = motion.time[:-1][motion.jump]
    np.testing.assert_allclose(jumps, np.arange(10) * 0.02, atol=1e-8)
    assert motion.travel[-1] == pytest.approx(0.001 * (0.02 * 36 + 0.019 * 9), abs=1e-10)


def test_no_duration_is_too_short() -> None:
    """A function over a microsecond."""
    motion = follow(lambda t: 0.004, 0.0, 0.0, 1e-6)
    assert motion.travel[-1] == pytest.approx(4e-9)


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
    got_travel, got_velocity = evaluate(motion, time)
    np.testing.assert_allclose(got_travel, travel, rtol=0, atol=1e-15)
    np.testing.assert_allclose(got_velocity, velocity, rtol=0, atol=1e-15)


def test_lines_through_points() -> None:
    """Δx / Δt between the points that are kept; a point on the line between others is not."""
    motion = through_points(
        np.array([0.0, 1.0, 2.0, 4.0]), np.array([0.0, 0.001, 0.002, 0.0]), 1e-6
    )
    np.testing.assert_allclose(motion.time, [0.0, 2.0, 4.0])
    np.testing.assert_allclose(motion.velocity, [0.001, -0.001])
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
