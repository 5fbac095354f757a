"""Commanded motion of the prismatic joint as a table the kernels can follow exactly."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.kernels.base_motion import Motion
from hma_gripper_sim.kernels.swinging_door import swinging_door
from hma_gripper_sim.quantities import quantity

Array = NDArray[np.float64]
Velocity = float | Callable[[float], float]

STEADY = 1e-6  # relative, and m/s²; a smaller change of the acceleration is no jump
ROUND_OFF = 1e-12  # likewise; a smaller one is none at all
SHORTEST = 1e-9  # s; a change of velocity within less than this is a jump
STRAIGHT = 1e-4  # of the largest velocity; a deviation from a straight line that is kept


def ramp(
    start: float, travel: float, duration: float, before: float, after: float, jump: bool
) -> Motion:
    """Velocity linear in time from `before` to `after` [m/s] within `duration` [s].

    `jump` says whether that differs from the motion so far in velocity or acceleration.
    """
    return Motion(
        np.array([start, start + duration]),
        np.array([travel, travel + 0.5 * (before + after) * duration]),
        np.array([before]),
        np.array([(after - before) / duration]),
        np.array([jump]),
    )


def follow(velocity: Velocity, start: float, travel: float, duration: float) -> Motion:
    """Tabulate a velocity [m/s], a number or a function of time.

    A function is sampled until straight lines between the samples follow it; where it jumps,
    the jump is located and kept.

    Raises
    ------
    InputError
        The velocity is not a finite number somewhere.
    """
    if not callable(velocity):
        value = _checked(velocity, start)
        return ramp(start, travel, duration, value, value, True)

    def at(t: float) -> float:
        return _checked(velocity(t), t)

    count = max(2, math.ceil(duration / 0.005) + 1)
    grid = [float(t) for t in np.linspace(start, start + duration, count)]
    values = [at(t) for t in grid]
    scale = STRAIGHT * max(1e-6, *(abs(value) for value in values))
    pieces: list[tuple[float, float, float, float]] = []
    for a, b, va, vb in zip(grid, grid[1:], values, values[1:], strict=False):
        todo = [(a, b, va, vb)]
        while todo:
            a, b, va, vb = todo.pop()
            middle = 0.5 * (a + b)
            if b - a <= SHORTEST * max(1.0, abs(b)):
                pieces.append((a, middle, va, va))
                pieces.append((middle, b, vb, vb))
                continue
            quarters = (at(a + 0.25 * (b - a)), at(middle), at(b - 0.25 * (b - a)))
            expected = (0.75 * va + 0.25 * vb, 0.5 * (va + vb), 0.25 * va + 0.75 * vb)
            if all(abs(x - y) <= scale for x, y in zip(quarters, expected, strict=True)):
                pieces.append((a, b, va, vb))
            else:
                todo.append((middle, b, quarters[1], vb))
                todo.append((a, middle, va, quarters[1]))
    merged = _merge(pieces)
    time = np.array([piece[0] for piece in merged] + [merged[-1][1]])
    return _table(
        time,
        np.array([piece[2] for piece in merged]),
        np.array([piece[3] for piece in merged]),
        travel,
    )


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
        velocity[first],
        (velocity[last] - velocity[first]) / (period * (last - first)),
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
    rows = rows[: swinging_door(time, travel, tolerance, rows)]
    corners, reached = time[rows], travel[rows]
    velocity = np.diff(reached) / np.diff(corners)
    return Motion(
        corners, reached, velocity, np.zeros_like(velocity), np.ones(len(velocity), dtype=np.bool_)
    )


def part_of(motion: Motion, start: float, end: float) -> Motion:
    """Return the motion from `start` to `end` [s], both within it."""
    first = max(0, int(np.searchsorted(motion.time, start, side="right")) - 1)
    last = min(int(np.searchsorted(motion.time, end, side="left")), len(motion.velocity))
    time, travel = motion.time[first : last + 1].copy(), motion.travel[first : last + 1].copy()
    velocity = motion.velocity[first:last].copy()
    acceleration, jump = motion.acceleration[first:last], motion.jump[first:last].copy()
    into, until = start - time[0], end - time[-2]
    travel[-1] = travel[-2] + until * (velocity[-1] + 0.5 * acceleration[-1] * until)
    if into > 0.0:
        travel[0] += into * (velocity[0] + 0.5 * acceleration[0] * into)
        velocity[0] += acceleration[0] * into
        jump[0] = False
    time[0], time[-1] = start, end
    return Motion(time, travel, velocity, acceleration, jump)


def _merge(
    pieces: list[tuple[float, float, float, float]],
) -> list[tuple[float, float, float, float]]:
    """Join neighbouring pieces of the same constant velocity."""
    merged = [pieces[0]]
    for a, b, va, vb in pieces[1:]:
        start, _, before, after = merged[-1]
        if before == after == va == vb:
            merged[-1] = (start, b, before, after)
        else:
            merged.append((a, b, va, vb))
    return merged


def _table(time: np.ndarray, before: np.ndarray, after: np.ndarray, travel: float) -> Motion:
    lengths = np.diff(time)
    distance = np.concatenate([[travel], travel + np.cumsum(0.5 * (before + after) * lengths)])
    jump = np.ones(len(before), dtype=np.bool_)
    jump[1:] = before[1:] != after[:-1]
    return Motion(time, distance, before, (after - before) / lengths, jump)


def _checked(value: object, t: float) -> float:
    try:
        return quantity(value, "m/s", field="velocity", source="simulate")
    except InputError as error:
        raise InputError(f"{error.reason} at t = {t:g} s", field="velocity") from None
