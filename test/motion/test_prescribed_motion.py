"""Commanded motions: numbers, ramps and functions of time, followed exactly."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, PPoly

from hma_gripper_sim import InputError
from hma_gripper_sim.kernels.base_motion import Motion
from hma_gripper_sim.motion.prescribed_motion import (
    evaluate,
    follow,
    of_ticks,
    part_of,
    ramp,
    through_points,
)


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


def counted(function: Callable[[float], float]) -> tuple[Callable[[float], float], list[float]]:
    """The function, and the times at which it has been called."""
    calls: list[float] = []

    def call(t: float) -> float:
        calls.append(t)
        return function(t)

    return call, calls


def deviation(
    motion: Motion, velocity: Callable[[float], float], away: float = 1e-9
) -> tuple[float, float]:
    """Largest error of the velocity and of the acceleration, each relative to its largest value.

    At times that are no samples, and away from what jumps; accelerations by central differences.
    """
    time = np.linspace(motion.time[0], motion.time[-1], 7919)[1:-1]
    for jump in motion.time[:-1][motion.jump]:
        time = time[np.abs(time - jump) > away]
    _, followed, acceleration = evaluate(motion, time)
    wanted = np.array([velocity(float(t)) for t in time])
    step = 2e-5
    ahead, behind = (np.array([velocity(float(t) + s) for t in time]) for s in (step, -step))
    slope = 0.5 * (ahead - behind) / step
    steep = max(1e-12, float(np.abs(slope).max()))
    return (
        float(np.abs(followed - wanted).max() / np.abs(wanted).max()),
        float(np.abs(acceleration - slope).max() / steep),
    )


def breaks(motion: Motion) -> np.ndarray:
    """Times at which the velocity or the acceleration jumps, without the start."""
    return motion.time[:-1][motion.jump][1:]


@pytest.mark.parametrize("at", [2.0, 1.23456789, 1e-3, 6.9999])
def test_a_jump_is_located(at: float) -> None:
    """To rounding, with 60 calls more than without it, and nothing else is taken for one."""
    velocity, calls = counted(lambda t: 0.004 if t < at else -0.001)
    motion = follow(velocity, 0.0, 0.0, 7.0)
    np.testing.assert_allclose(breaks(motion), [at], rtol=0, atol=1e-15)
    assert motion.travel[-1] == pytest.approx(0.004 * at - 0.001 * (7.0 - at), rel=1e-14)
    assert len(calls) <= 7 * 500 + 10 + 60


@pytest.mark.parametrize("frequency", [0.5, 5.0, 20.0])
def test_a_sine_is_followed(frequency: float) -> None:
    """Velocity, acceleration and travel of v sin(2 pi f t), at 500 calls per second.

    Polynomials of degree 11 through samples 2 ms apart leave 7e-12 of it at 20 Hz.
    """
    rate = 2.0 * math.pi * frequency
    velocity, calls = counted(lambda t: 0.01 * math.sin(rate * t))
    motion = follow(velocity, 0.0, 0.0, 4.0)
    time = np.linspace(0.0, 4.0, 7919)
    travel, followed, acceleration = evaluate(motion, time)
    np.testing.assert_allclose(followed, 0.01 * np.sin(rate * time), rtol=0, atol=1e-12)
    np.testing.assert_allclose(
        acceleration, 0.01 * rate * np.cos(rate * time), rtol=0, atol=1e-9 * 0.01 * rate
    )
    np.testing.assert_allclose(
        travel, 0.01 / rate * (1.0 - np.cos(rate * time)), rtol=0, atol=1e-14
    )
    assert not len(breaks(motion))
    assert len(calls) <= 4 * 500 + 10
    # Continuous from piece to piece: the velocity to rounding, the acceleration nearly.
    joints = motion.time[1:-1]
    before, after = evaluate(motion, joints, before=True), evaluate(motion, joints)
    np.testing.assert_allclose(before[1], after[1], rtol=0, atol=1e-15)
    np.testing.assert_allclose(before[2], after[2], rtol=0, atol=1e-9 * 0.01 * rate)


@pytest.mark.parametrize(
    "velocity",
    [
        lambda t: 0.002 * t,
        lambda t: 0.004 * math.tanh(50.0 * (t - 2.0)),
        lambda t: 0.01 * math.exp(-(((t - 1.7) / 0.02) ** 2)),
    ],
)
def test_smooth_functions_have_no_breaks(velocity: Callable[[float], float]) -> None:
    motion = follow(velocity, 0.0, 0.0, 4.0)
    assert not len(breaks(motion))
    assert deviation(motion, velocity)[0] < 1e-9


RAMPS = ([0.0, 0.1, 0.6, 0.7, 1.2, 1.3], [0.0, 0.01, 0.01, 0.0, 0.0, -0.01])


@pytest.mark.parametrize(
    ("velocity", "at"),
    [
        (lambda t: 0.004 * abs(t - 1.7), [1.7]),
        (lambda t: 0.004 * abs(t - 1.7003), [1.7003]),
        (lambda t: 0.05 * math.sin(125.0 * t) + 0.01 * abs(t - 1.2345), [1.2345]),
        (lambda t: float(np.interp(t, *RAMPS)), [0.1, 0.6, 0.7, 1.2, 1.3]),
    ],
)
def test_a_kink_is_located(velocity: Callable[[float], float], at: list[float]) -> None:
    """To where both sides have the same velocity; neither of them rings."""
    called, calls = counted(velocity)
    motion = follow(called, 0.0, 0.0, 4.0)
    np.testing.assert_allclose(breaks(motion), at, rtol=0, atol=2e-8)
    error, slope_error = deviation(motion, velocity, away=3e-5)
    assert error < 1e-9
    assert slope_error < 1e-5  # that of the differences
    assert deviation(motion, velocity)[0] < 1e-9
    assert len(calls) <= 4 * 500 + 10 + 60 * len(at)


@pytest.mark.parametrize(
    ("velocity", "at"),
    [
        (lambda t: 0.004 if t < 1.2345 else 0.008 if t < 1.234503 else -0.001, [1.2345, 1.234503]),
        (lambda t: 0.05 if 0.5013 < t < 0.5034 else 0.0, [0.5013, 0.5034]),
        (lambda t: 0.05 if 0.5 <= t < 0.506 else 0.0, [0.5, 0.506]),
        (
            lambda t: 0.0 if t < 1.0003 else t - 1.0003 if t < 1.0008 else 0.004,
            [1.0003, 1.0008],
        ),
    ],
    ids=["3 us apart", "pulse of 2.1 ms", "pulse on the grid", "kink and jump"],
)
def test_breaks_near_each_other(velocity: Callable[[float], float], at: list[float]) -> None:
    called, calls = counted(velocity)
    motion = follow(called, 0.0, 0.0, 3.0)
    np.testing.assert_allclose(breaks(motion), at, rtol=0, atol=1e-8)
    assert deviation(motion, velocity, away=1e-8)[0] < 1e-9
    assert len(calls) <= 3 * 600 + 60 * len(at)


def test_steps_of_a_staircase() -> None:
    """A command held for 4 ms at a time (a bus, a log) keeps every step."""
    motion = follow(lambda t: 0.001 * math.floor(t / 0.004 + 1e-9), 0.0, 0.0, 0.199)
    np.testing.assert_allclose(breaks(motion), np.arange(1, 50) * 0.004, rtol=0, atol=1e-11)
    exact = 0.001 * (0.004 * sum(range(49)) + 0.003 * 49)
    assert motion.travel[-1] == pytest.approx(exact, rel=1e-9)


def test_noise_is_followed_within_a_bounded_number_of_calls() -> None:
    """White noise of 10 um/s: cubics through the samples, and at most 5500 calls per second."""
    rng = np.random.default_rng(0)
    velocity, calls = counted(lambda t: 0.004 + 1e-5 * rng.standard_normal())
    motion = follow(velocity, 0.0, 0.0, 3.0)
    assert len(calls) <= 3 * 5500 + 1000
    followed = evaluate(motion, np.linspace(0.0, 3.0, 10_000))[1]
    assert np.abs(followed - 0.004).max() < 8e-5
    assert motion.travel[-1] == pytest.approx(0.012, rel=1e-3)


def test_a_long_hold_is_a_few_segments() -> None:
    """1000 s at a constant velocity that is given as a function: exact, in 20 pieces or fewer."""
    motion = follow(lambda t: 0.004, 0.0, 0.0, 1000.0)
    assert motion.velocity.shape[0] <= 20
    assert motion.velocity.shape[1] == 1
    assert motion.travel[-1] == pytest.approx(4.0, rel=1e-15)


@pytest.mark.parametrize("belongs", ["before", "after", "neither"])
def test_declared_breakpoints(belongs: str) -> None:
    """Whatever the function is at its breaks, 1 us apart or not; a declared break is kept."""

    def velocity(t: float) -> float:
        if t in (0.3, 0.300001, 0.7):
            return {"before": 0.01, "after": 0.05, "neither": 1e3}[belongs]
        return 0.01 + (0.02 if t > 0.3 else 0.0) + (0.02 if t > 0.300001 else 0.0)

    called, calls = counted(velocity)
    motion = follow(called, 0.0, 0.0, 1.0, breakpoints=[0.7, 0.3, 0.300001, 2.0])
    np.testing.assert_array_equal(breaks(motion), [0.3, 0.300001, 0.7])
    assert motion.travel[-1] == pytest.approx(0.01 + 0.02 * 0.7 + 0.02 * 0.699999, rel=1e-13)
    assert len(calls) <= 600


def test_segments() -> None:
    """Pairs of a duration and a velocity; what is beyond the end is left out."""
    segments: list[Any] = [(0.5, 0.004), ("200 ms", "-2 mm/s"), (1.0, 0.001)]
    motion = follow(segments, 2.0, 0.1, 1.0)
    np.testing.assert_allclose(motion.time, [2.0, 2.5, 2.7, 3.0], rtol=1e-15)
    np.testing.assert_allclose(motion.travel, [0.1, 0.102, 0.1016, 0.1019], rtol=1e-14)
    assert motion.jump.all()


@pytest.mark.parametrize(
    "bad", [[(0.5, 0.004)], [], [(0.0, 0.004)], [(1.0, math.nan)], [(1.0,)], [0.004, 0.003], "1 s"]
)
def test_bad_segments(bad: object) -> None:
    with pytest.raises(InputError) as refusal:
        follow(bad, 0.0, 0.0, 1.0)  # type: ignore[arg-type]
    assert refusal.value.field is not None
    assert refusal.value.field.startswith("velocity")


def test_a_spline_is_taken_over() -> None:
    """Its values to rounding over a part of its span, and no break: it is smooth twice."""
    knots = np.linspace(-0.3, 2.1, 9)
    spline = CubicSpline(knots, 0.01 * np.sin(knots))
    motion = follow(spline, 0.5, 0.02, 1.5)
    time = np.linspace(0.5, 2.0, 1001)
    travel, velocity, acceleration = evaluate(motion, time)
    np.testing.assert_allclose(velocity, spline(time), rtol=0, atol=1e-16)
    np.testing.assert_allclose(acceleration, spline(time, 1), rtol=0, atol=1e-15)
    integral = spline.antiderivative()
    np.testing.assert_allclose(travel, 0.02 + integral(time) - integral(0.5), rtol=0, atol=1e-16)
    assert not len(breaks(motion))
    assert (motion.time[0], motion.time[-1]) == (0.5, 2.0)


def test_breaks_of_polynomials() -> None:
    """Piecewise linear: a joint without a change, a kink, a jump."""
    polynomial = PPoly([[1.0, 1.0, -2.0, 0.0], [0.0, 1.0, 2.0, 5.0]], [0.0, 1.0, 2.0, 3.0, 4.0])
    np.testing.assert_array_equal(breaks(follow(polynomial, 0.0, 0.0, 4.0)), [2.0, 3.0])


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        (PPoly([[0.004]], [0.0, 0.5]), "from 0 s to 0.5 s"),
        (PPoly([[0.004]], [0.5, 2.0]), "from 0.5 s to 2 s"),
        (PPoly([[0.004, math.nan]], [0.0, 0.5, 2.0]), "t = 0.5 s"),
        (PPoly([[[0.004, 0.004]]], [0.0, 2.0]), "one component"),
        (PPoly([[1j]], [0.0, 2.0]), "real"),
    ],
)
def test_bad_polynomials(bad: PPoly, reason: str) -> None:
    with pytest.raises(InputError, match=reason) as refusal:
        follow(bad, 0.0, 0.0, 1.0)
    assert refusal.value.field == "velocity"


@pytest.mark.parametrize("velocity", [0.004, [(1.0, 0.004)], PPoly([[0.004]], [0.0, 1.0])])
def test_breakpoints_belong_to_functions(velocity: object) -> None:
    with pytest.raises(InputError) as refusal:
        follow(velocity, 0.0, 0.0, 1.0, breakpoints=[0.5])  # type: ignore[arg-type]
    assert refusal.value.field == "breakpoints"


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
    time = np.asarray(2.0 + 0.01 * np.arange(len(velocity)), dtype=np.float64)
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
