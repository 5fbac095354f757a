"""Commanded motion of the prismatic joint as polynomials of time that the kernels follow."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.kernels.base_motion import Motion, add_up_travel
from hma_gripper_sim.kernels.straight_lines import trend_corners
from hma_gripper_sim.motion.velocity_function import sampled
from hma_gripper_sim.units import quantity

Array = NDArray[np.float64]
Velocity = float | str | Sequence[tuple[float, float]] | Callable[[float], float]  # or a PPoly

STEADY = 1e-6  # relative, and m/s²; a smaller change of the acceleration is no jump
ROUND_OFF = 1e-12  # relative, and m/s² or s; a smaller difference is none at all
SMOOTH = 1e-10  # relative; a smaller change of a polynomial's slope is rounding


def ramp(
    start: float, travel: float, duration: float, before: float, after: float, jump: bool
) -> Motion:
    """Velocity linear in time from `before` to `after` [m/s] within `duration` [s].

    `jump` says whether that differs from the motion so far in velocity or acceleration.
    """
    return Motion(
        np.array([start, start + duration]),
        np.array([travel, travel + 0.5 * (before + after) * duration]),
        np.array([[before, (after - before) / duration]]),
        np.array([jump]),
    )


def follow(
    velocity: Velocity,
    start: float,
    travel: float,
    duration: float,
    breakpoints: Sequence[float] | None = None,
) -> Motion:
    """Return the motion at a velocity [m/s] from a time [s] and a travel [m] on.

    Parameters
    ----------
    velocity
        One of

        - a number, or a text with its unit, such as ``"4 mm/s"``;
        - segments of constant velocity, which follow each other from `start` on: pairs
          (duration [s], velocity [m/s]);
        - a `scipy.interpolate.PPoly` of time, such as a spline, which is taken over as it is;
        - a function of time, see `velocity_function.sampled`.
    breakpoints
        Times [s] of all jumps and kinks of a function; None: they are looked for.

    Raises
    ------
    InputError
        The velocity is not a finite number somewhere, or not given for the whole duration.
    """
    if breakpoints is not None and (isinstance(velocity, PPoly) or not callable(velocity)):
        raise InputError(
            "only a velocity that is a function has them", field="breakpoints", source="simulate"
        )
    end = start + duration
    if isinstance(velocity, PPoly):
        time, pieces, jump = _polynomials(velocity, start, end)
    elif callable(velocity):
        time, pieces, jump = sampled(velocity, start, end, _times(breakpoints))
    elif isinstance(velocity, Sequence | np.ndarray) and not isinstance(velocity, str):
        time, pieces, jump = _segments(velocity, start, end)
    else:
        value = quantity(velocity, "m/s", field="velocity", source="simulate")
        time, pieces, jump = np.array([start, end]), np.array([[value]]), np.array([True])
    motion = Motion(time, np.empty(len(time)), pieces, jump)
    motion.travel[0] = travel
    add_up_travel(motion)
    return motion


def evaluate(motion: Motion, time: Array, before: bool = False) -> tuple[Array, Array, Array]:
    """Travel [m], velocity [m/s] and acceleration [m/s^2] at times within a motion [s].

    `before` says which value of a jump is meant: the one before it or the one after.
    """
    row = np.searchsorted(motion.time, time, side="left" if before else "right") - 1
    row = np.clip(row, 0, len(motion.jump) - 1)
    dt = time - motion.time[row]
    travel, velocity, acceleration = np.zeros((3, *np.shape(time)))
    for k in range(motion.velocity.shape[1] - 1, -1, -1):
        coefficient = motion.velocity[row, k]
        acceleration = acceleration * dt + velocity
        velocity = velocity * dt + coefficient
        travel = travel * dt + coefficient / (k + 1)
    return motion.travel[row] + travel * dt, velocity, acceleration


def of_ticks(start: float, period: float, travel: Array, velocity: Array) -> Motion:
    """Motion of a drive whose velocity is linear within each tick.

    Parameters
    ----------
    start, period
        Time of the first row, and from row to row [s].
    travel, velocity
        At the ends of the ticks [m, m/s], shape (n + 1,).
    """
    acceleration = np.diff(velocity) / period
    change = np.abs(np.diff(acceleration))
    largest = np.maximum(np.abs(acceleration[1:]), np.abs(acceleration[:-1]))
    corners = np.flatnonzero(change > ROUND_OFF * np.maximum(1.0, largest)) + 1
    rows = np.concatenate([[0], corners, [len(acceleration)]])
    first, last = rows[:-1], rows[1:]
    jump = np.ones(len(first), dtype=np.bool_)
    jump[1:] = (change > STEADY * np.maximum(1.0, largest))[corners - 1]
    return Motion(
        start + period * rows,
        travel[rows],
        np.column_stack(
            [velocity[first], (velocity[last] - velocity[first]) / (period * (last - first))]
        ),
        jump,
    )


def through_points(time: Array, travel: Array, tolerance: float) -> Motion:
    """Motion at constant velocities that keeps within a tolerance of measured points.

    Its corners are some of the points: as few as a single pass over them finds (swinging door
    trending, E. H. Bristol 1990). The velocity between two corners is Δtravel / Δtime, so that
    the travel is consistent with it.

    Parameters
    ----------
    time, travel
        Of the points [s, m], time increasing, shape (n,) with n > 1.
    tolerance
        [m]
    """
    rows = np.empty(len(time), dtype=np.intp)
    rows = rows[: trend_corners(time, travel, tolerance, rows)]
    corners, reached = time[rows], travel[rows]
    velocity = np.diff(reached) / np.diff(corners)
    return Motion(corners, reached, velocity[:, None], np.ones(len(velocity), dtype=np.bool_))


def part_of(motion: Motion, start: float, end: float) -> Motion:
    """Return the motion from `start` to `end` [s], both within it."""
    first = max(0, int(np.searchsorted(motion.time, start, side="right")) - 1)
    last = min(int(np.searchsorted(motion.time, end, side="left")), len(motion.jump))
    time, travel = motion.time[first : last + 1].copy(), motion.travel[first : last + 1].copy()
    velocity, jump = motion.velocity[first:last].copy(), motion.jump[first:last].copy()
    travel[-1] = evaluate(motion, np.array(end), before=True)[0]
    if start > time[0]:
        travel[0] = evaluate(motion, np.array(start))[0]
        _shift(velocity[0], start - time[0])
        jump[0] = False
    time[0], time[-1] = start, end
    return Motion(time, travel, velocity, jump)


def _shift(polynomial: Array, by: float) -> None:
    """Expand a polynomial about a point further on, in place; coefficients ascending."""
    for i in range(len(polynomial) - 1):
        for k in range(len(polynomial) - 2, i - 1, -1):
            polynomial[k] += by * polynomial[k + 1]


def _segments(
    velocity: Sequence[Any] | NDArray[Any], start: float, end: float
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Segments of constant velocity as polynomials."""
    pairs = []
    for i, pair in enumerate(velocity):
        if isinstance(pair, str) or not isinstance(pair, Sequence | np.ndarray) or len(pair) != 2:
            raise InputError(
                "expected a number, a function of time, a PPoly or pairs of a duration [s] and a "
                f"velocity [m/s], got {pair!r} in a sequence",
                field="velocity",
                source="simulate",
            )
        name = f"velocity[{i}]"
        length = quantity(pair[0], "s", field=name, source="simulate", minimum=0.0, exclusive=True)
        pairs.append((length, quantity(pair[1], "m/s", field=name, source="simulate")))
    corners = start + np.cumsum([0.0, *(length for length, _ in pairs)])
    _check_span(corners, start, end)
    count = max(1, int(np.searchsorted(corners[1:-1], end)) + 1)
    time = np.append(corners[:count], end)
    constant = np.array([value for _, value in pairs[:count]])
    return time, constant[:, None], np.append(True, np.diff(constant) != 0.0)


def _polynomials(
    velocity: PPoly, start: float, end: float
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Take over the pieces of a PPoly between two times; jumps are what exceeds rounding."""
    corners, pieces = np.asarray(velocity.x), np.asarray(velocity.c)
    if pieces.ndim != 2 or np.iscomplexobj(pieces) or corners[-1] < corners[0]:
        raise InputError(
            "a PPoly must be real, of one component and in ascending time",
            field="velocity",
            source="simulate",
        )
    _check_span(corners, start, end)
    bad = ~np.isfinite(pieces).all(axis=0)
    if bad.any():
        raise InputError(
            f"must be finite at t = {corners[:-1][bad][0]:g} s", field="velocity", source="simulate"
        )
    first = int(np.searchsorted(corners[1:-1], start, side="right"))
    last = int(np.searchsorted(corners[1:-1], end, side="left")) + 1
    time = np.array(corners[first : last + 1], dtype=np.float64)
    ascending = np.array(pieces[::-1, first:last].T, dtype=np.float64, order="C")
    _shift(ascending[0], start - time[0])
    time[0], time[-1] = start, end
    lengths = np.diff(time)
    value, slope, size, steepness = np.zeros((4, len(lengths)))
    for k in range(ascending.shape[1] - 1, -1, -1):
        slope, steepness = slope * lengths + value, steepness * lengths + size
        value = value * lengths + ascending[:, k]
        size = size * lengths + np.abs(ascending[:, k])
    following = ascending[1:, 1] if ascending.shape[1] > 1 else np.zeros(len(lengths) - 1)
    size, steepness = np.maximum(size[1:], size[:-1]), np.maximum(steepness[1:], steepness[:-1])
    shorter = np.minimum(lengths[1:], lengths[:-1])
    jump = np.abs(ascending[1:, 0] - value[:-1]) > ROUND_OFF * size
    kink = np.abs(following - slope[:-1]) > SMOOTH * steepness + ROUND_OFF * size / shorter
    return time, ascending, np.append(True, jump | kink)


def _check_span(corners: Array, start: float, end: float) -> None:
    """Refuse a velocity that is not given from `start` to `end` [s]."""
    slack = ROUND_OFF * max(1.0, abs(start), abs(end))
    if corners[0] > start + slack or corners[-1] < end - slack:
        raise InputError(
            f"is given from {corners[0]:g} s to {corners[-1]:g} s, not for all of "
            f"{start:g} s to {end:g} s",
            field="velocity",
            source="simulate",
        )


def _times(breakpoints: Sequence[float] | None) -> Array | None:
    if breakpoints is None:
        return None
    times = [quantity(t, "s", field="breakpoints", source="simulate") for t in breakpoints]
    return np.unique(np.array(times, dtype=np.float64))
