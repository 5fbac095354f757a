"""Prescribed motion of the base: piecewise polynomials of time, evaluated exactly."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.compiled import kernel

Array = NDArray[np.float64]


class Motion(NamedTuple):
    """Motion of the base in segments, on each of which its velocity is a polynomial of time.

    From one segment to the next the velocity and the acceleration are continuous, up to what
    interpolation leaves, unless `jump` says that one of them jumps.
    """

    time: Array  # start of each segment and end of the last [s], shape (m + 1,)
    travel: Array  # at these times [m], shape (m + 1,)
    velocity: Array  # coefficients of (t - start)^k on each segment [m/s^(k+1)], shape (m, K)
    jump: NDArray[np.bool_]  # velocity or acceleration jump at the segment's start, shape (m,)


class Stretch(NamedTuple):
    """A step's part of the motion."""

    motion: Motion
    segment: int  # that `t` lies on
    t: float  # start [s]
    h: float  # length [s]; no jump of the velocity lies within


@kernel
def base_motion(motion: Motion, segment: int, t: float, base: Array) -> None:
    """Height, velocity and acceleration of the base at time `t` of a segment onwards.

    Parameters
    ----------
    segment
        One that starts at `t` or earlier, with no jump between that start and `t`: at the time
        of a jump, and where rounding puts `t` beyond it, the values are those before it.
    base
        Height [m], velocity [m/s] and acceleration [m/s^2], upwards; shape (3,).
    """
    last = motion.jump.size - 1
    while segment < last and t > motion.time[segment + 1] and not motion.jump[segment + 1]:
        segment += 1
    dt = t - motion.time[segment]
    distance, velocity, acceleration = 0.0, 0.0, 0.0
    for k in range(motion.velocity.shape[1] - 1, -1, -1):
        coefficient = motion.velocity[segment, k]
        acceleration = acceleration * dt + velocity
        velocity = velocity * dt + coefficient
        distance = distance * dt + coefficient / (k + 1)
    base[0] = -(motion.travel[segment] + distance * dt)
    base[1] = -velocity
    base[2] = -acceleration


@kernel
def base_in_step(stretch: Stretch, theta: float, base: Array) -> None:
    """Height, velocity and acceleration of the base at a share `theta` of a step, shape (3,)."""
    base_motion(stretch.motion, stretch.segment, stretch.t + theta * stretch.h, base)


@kernel
def add_up_travel(motion: Motion) -> None:
    """Fill in `Motion.travel` from its first value and the velocity on."""
    for i in range(motion.jump.size):
        dt = motion.time[i + 1] - motion.time[i]
        distance = 0.0
        for k in range(motion.velocity.shape[1] - 1, -1, -1):
            distance = distance * dt + motion.velocity[i, k] / (k + 1)
        motion.travel[i + 1] = motion.travel[i] + distance * dt


@kernel
def acceleration_bound(stretch: Stretch) -> float:
    """Bound on the base's acceleration in a step [m/s^2]."""
    motion, segment = stretch.motion, stretch.segment
    start, end = stretch.t, stretch.t + stretch.h
    bound = 0.0
    for i in range(segment, motion.jump.size):
        if i > segment and motion.time[i] >= end:
            break
        near = max(start, motion.time[i]) - motion.time[i]
        span = min(end, motion.time[i + 1]) - motion.time[i]
        # From where the stretch begins, of the acceleration's Taylor polynomial: |a| + sum |terms|.
        value, rest, power = 0.0, 0.0, 1.0
        for k in range(1, motion.velocity.shape[1]):
            coefficient = k * motion.velocity[i, k]
            value += coefficient * power
            rest += abs(coefficient) * (max(0.0, span) ** (k - 1) - near ** (k - 1))
            power *= near
        bound = max(bound, abs(value) + rest)
    return bound
